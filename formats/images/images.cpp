#include "formats/images/images.hpp"
