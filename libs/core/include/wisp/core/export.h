#pragma once

#include "wisp/core/version.h"

// WISP_API marks what a shared build exports. Everything else is hidden.

#if defined(WISP_STATIC)
#define WISP_API
#elif defined(_WIN32)
#if defined(WISP_BUILDING)
#define WISP_API __declspec(dllexport)
#else
#define WISP_API __declspec(dllimport)
#endif
#else
#define WISP_API __attribute__((visibility("default")))
#endif
