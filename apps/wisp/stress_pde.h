#pragma once

#include "stress_table.h"

// The stiff and extreme cases of wisp::pde, all computed now. An estimate is held to its
// answer within five of its standard errors (a false alarm in two million), and a part of
// 1e-5 of it for the shell.
std::vector<stress_row> stress_pde(const stress_options& options);
