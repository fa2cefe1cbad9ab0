// What most tests include.
#include "library.hpp"

#include <gtest/gtest.h>
