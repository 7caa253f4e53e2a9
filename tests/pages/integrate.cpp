// The program of docs/integrate.md.
#include "integrate-3.inc"
