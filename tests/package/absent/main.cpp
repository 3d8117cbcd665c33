#include "wisp/hair/math.h"

int main() { return 0; }
