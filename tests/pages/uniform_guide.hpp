// The header that docs/guides.md makes of its first two blocks, and its SARSA grid.
#pragma once

#include "guides-1.inc"
#include "guides-2.inc"
#include "guides-3.inc"
