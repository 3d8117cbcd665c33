#pragma once

// The version of these headers, and the mark of what is on its way out. Both wisp::core
// and wisp::hair have this file, so that neither needs the other; they say the same.
//
// Versions follow SemVer (https://semver.org). Before 1.0 a minor version may change
// what is public, a patch version may not.

#define WISP_VERSION_MAJOR 0
#define WISP_VERSION_MINOR 1
#define WISP_VERSION_PATCH 0
#define WISP_VERSION_STRING "0.1.0"

// To compare: #if WISP_VERSION_NUMBER >= WISP_MAKE_VERSION(0, 2, 0)
#define WISP_MAKE_VERSION(major, minor, patch) ((major)*10000 + (minor)*100 + (patch))
#define WISP_VERSION_NUMBER \
  WISP_MAKE_VERSION(WISP_VERSION_MAJOR, WISP_VERSION_MINOR, WISP_VERSION_PATCH)

// Stands before the declaration of what goes with the next minor version, and says since
// when and what to use instead: WISP_DEPRECATED("since 0.2; use make_bvh"). Programs that
// define WISP_NO_DEPRECATED are not warned.
#if defined(WISP_NO_DEPRECATED)
#define WISP_DEPRECATED(text)
#else
#define WISP_DEPRECATED(text) [[deprecated(text)]]
#endif
