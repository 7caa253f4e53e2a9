// The header that docs/integrate.md makes of its first two blocks.
#pragma once

#include "integrate-1.inc"
#include "integrate-2.inc"
