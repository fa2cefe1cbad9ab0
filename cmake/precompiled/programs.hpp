// Read once for all examples and those benchmarks that only call the library.
#pragma once

#include "precompiled/command.hpp"
