#include "wisp/core/export.h"

WISP_API int new_way(int i);
WISP_DEPRECATED("since 0.1; use new_way") WISP_API int old_way(int i);
class WISP_API new_thing {};
class WISP_DEPRECATED("since 0.1; use new_thing") WISP_API old_thing {};

#if defined(USE_NEW)
int use(const new_thing&) { return new_way(1); }
#else
int use(const old_thing&) { return old_way(1); }
#endif
