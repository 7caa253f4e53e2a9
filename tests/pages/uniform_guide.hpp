// The header that the first two blocks of docs/guides.md make up, with its SARSA grid and its irradiance
// records.
#pragma once

#include "guides-1.inc"
#include "guides-2.inc"
#include "guides-3.inc"
#include "guides-4.inc"
#include "guides-5.inc"
