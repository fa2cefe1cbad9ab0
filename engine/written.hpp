#pragma once

#include "presentation/colormap.hpp"
#include "request/geometry.hpp"
#include "request/input.hpp"
#include "request/make_request.hpp"
#include "request/outputs.hpp"
#include "request/tail.hpp"

namespace edgewise {

/// What is written of a request: its tail, and the description that goes into the file.
struct Written {
    Tail tail;
    store::Header header;
    /// A volume becomes so many files of one plane, each of which `header` describes, but for
    /// where it lies.
    std::int64_t slices = 1;
    std::shared_ptr<const Colormap> colours;  // of a view of one channel; null: grey
    std::string value_unit;                   // of the results: "HU", "HU mm" ...; "": not known
    std::vector<Message> warnings;
};

/// Samples of a result as they are written.
Array written_samples(const Data& result, const Written& written, const Shades& levels,
                      std::pmr::memory_resource* memory);

/// @param low,high  of the input's values
/// @throws RequestError where the format can hold neither values nor a view of this
Written written_of(const Request& want, const Query& query, const Geometry& geometry,
                   const Input& input, const Outputs& outputs, double low, double high);

}  // namespace edgewise
