// What most sources of the command include. CLI11 and nlohmann::json are not among it: their inline
// functions would be made once more for every source.
#include "library.hpp"
