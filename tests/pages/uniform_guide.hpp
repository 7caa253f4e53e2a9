// The header that docs/guides.md makes of its blocks.
#pragma once

#include "guides-1.inc"
#include "guides-2.inc"
