/* The only place that includes Embree. Debian 13 ships version 4, Debian 12 version 3. */
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#elif __has_include(<embree3/rtcore.h>)
#include <embree3/rtcore.h>
#else
#error "Embree headers not found: apt-get install -y libembree-dev"
#endif
