// Numbers and paths on command lines. Pass each of these to CLI::Option::transform(). Its error names the
// range.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>

namespace render {

/// A text of decimal digits only: "010" is ten. Refuses signs, other bases and numbers above 64 bits.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);

/// A whole number that is a power of two.
CLI::Validator power_of_two(std::uint64_t least, std::uint64_t most);

/// A decimal number in [least, most]. It may have an exponent.
CLI::Validator number(double least, double most);

/// A number in (0, most].
CLI::Validator positive_number(double most);

/// A whole number of bytes up to 1 TiB. It may have a unit, a power of 1024: B, K, KB, KiB, M, ... TiB.
CLI::Validator byte_count();

/// A path that is not empty.
CLI::Validator file_path();

}  // namespace render
