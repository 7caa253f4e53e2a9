// Numbers and paths on command lines. Each of these is for CLI::Option::transform(); its error names the
// range.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>

namespace render {

/// Decimal digits alone: "010" is ten; signs, other bases and what exceeds 64 bits are refused.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);

/// A whole number that is a power of two.
CLI::Validator power_of_two(std::uint64_t least, std::uint64_t most);

/// A decimal number, perhaps with an exponent, in [least, most].
CLI::Validator number(double least, double most);

/// One in (0, most].
CLI::Validator positive_number(double most);

/// A whole number of bytes up to 1 TiB, with or without a unit, which is of 1024: B, K, KB, KiB, M, ... TiB.
CLI::Validator byte_count();

/// A path that is not empty.
CLI::Validator file_path();

}  // namespace render
