#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "graph/data.hpp"
#include "graph/request.hpp"
#include "io/store.hpp"
#include "request/query.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// A window that radiologists have a name for, in Hounsfield units.
struct NamedWindow {
    std::string_view name;
    double width, level;
};
const std::vector<NamedWindow>& named_windows();

/// From level - width / 2 to level + width / 2.
Window window_around(double level, double width);

/// The window of a name, in any case; nothing where none is called so.
std::optional<Window> window_named(std::string_view name);

/// Brings a window in Hounsfield units to the values of data that are shifted by 1024, as some
/// scanners store them.
/// @return what is to be said of it: "" or a warning
Message take_hounsfield(Window& window, const store::Header& header, const Data& data,
                        const Statistics& statistics);

/// Whether a picture shows shares of light that are left.
bool is_radiograph(const Request& want) noexcept;

/// The window of a picture where the request names none; nothing: the range of the output.
///   drr            99.5 %, 1 %: where most light is taken away is white, as on a radiograph
///   mip of an MR   1 %, 99.9 %: few very bright samples do not darken all others
std::optional<Window> usual_window(const Request& want, const store::Header& header,
                                   const Data& data, const Statistics& statistics);

}  // namespace edgewise
