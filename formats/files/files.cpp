#include "formats/files/files.hpp"
