#pragma once

#include "stress_table.h"

// The stiff and extreme cases of wisp::hair, all computed now: special functions
// at their switches, integrals at the ends of the parameters, and random calls.
std::vector<stress_row> stress_hair(const stress_options& options);

// Those of them that are random calls (stress_hair_calls.cpp).
std::vector<stress_row> stress_hair_calls(const stress_options& options);

// Samples against the density (stress_hair_samples.cpp).
std::vector<stress_row> stress_hair_samples(const stress_options& options);
