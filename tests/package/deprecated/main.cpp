// The version, by the header that has it: alone, and beside that of hair.

#include <string>

#include "wisp/core/version.h"

int main() {
  const std::string version = std::to_string(WISP_VERSION_MAJOR) + "." +
                              std::to_string(WISP_VERSION_MINOR) + "." +
                              std::to_string(WISP_VERSION_PATCH);
  static_assert(WISP_VERSION_NUMBER >= WISP_MAKE_VERSION(0, 1, 0) &&
                WISP_VERSION_NUMBER < WISP_MAKE_VERSION(WISP_VERSION_MAJOR + 1, 0, 0));
  return version == WISP_VERSION_STRING ? 0 : 1;
}
