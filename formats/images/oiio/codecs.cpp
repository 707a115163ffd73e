#include <OpenImageIO/imageio.h>
