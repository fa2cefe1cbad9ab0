#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace edgewise::store {

/// The files of `pattern first last step`, where the pattern holds one %d or %0Nd: NRRD and
/// MetaImage share the notation. The pattern is never handed to printf.
/// @return paths that are there, inside the header's folder
/// @throws InputError another conversion, none or two, too many files, a missing one
std::vector<std::string> numbered_files(const std::string& header, std::string_view pattern,
                                        std::int64_t first, std::int64_t last, std::int64_t step);

/// Lines of a header from `offset` on, without line ends. Stops behind an empty line, or (where
/// `last` is given) behind the line that starts with it.
struct HeaderText {
    std::vector<std::string> lines;
    std::uint64_t end = 0;    // offset of the first byte behind it
    bool terminated = false;  // the line that ends it was found
};
class File;
HeaderText header_text(const File&, std::string_view last = {});

}  // namespace edgewise::store
