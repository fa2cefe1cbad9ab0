#pragma once

#include <functional>
#include <memory>

#include "charts/pictures.hpp"
#include "engine/path_runs.hpp"

namespace edgewise {

struct Looked;

/// Makes the pictures of a page: of each result the first frame (of volumes the middle
/// slice), at as many pixels as all channels together may have.
class PictureTaker {
 public:
    /// @param most_values  pixels of all channels together
    explicit PictureTaker(const Looked& looked, double most_values = 256 * 256);

    /// The picture of a result of the request.
    charts::Raster taken(const Data& result) const;
    /// The reference at the same pixels. Those that do not see the input are `elsewhere`'s: there
    /// is no error to be seen there.
    /// @param go_on  told the share that is done; false ends it. @return nothing then
    std::optional<charts::Raster> reference(const ReferenceField& field,
                                            std::pmr::memory_resource* memory,
                                            const charts::Raster& elsewhere,
                                            const std::function<bool(double)>& go_on) const;
    /// Puts black and white in: --window, else what a view of the base would have.
    void set_window(charts::Pictures& pictures) const;
    /// What the pictures are of.
    std::string note() const;
    /// The same in a few words: "Frame 0, 256 x 256 of its 512 x 512 samples".
    std::string shown() const;

    int width() const noexcept { return width_; }
    int height() const noexcept { return height_; }
    int channels() const noexcept { return channels_; }
    /// The output samples that are shown, row by row.
    std::vector<OutputSample> pixels() const;

 private:
    void put(const double* values, int channels, float* out) const;

    const Looked& looked_;
    Extent output_;
    int width_, height_, channels_;
};

}  // namespace edgewise
