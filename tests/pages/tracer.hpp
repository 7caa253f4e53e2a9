// The header that the first two blocks of docs/integrate.md make up.
#pragma once

#include "integrate-1.inc"
#include "integrate-2.inc"
