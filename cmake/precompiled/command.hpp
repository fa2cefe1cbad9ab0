// What most sources of the command include.
#include "library.hpp"
// Slow to read, so behind the others.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
