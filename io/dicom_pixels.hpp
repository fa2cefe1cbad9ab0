#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "io/dicom_file.hpp"

namespace edgewise::store {

/// How the samples of a DICOM file are in memory: looked up in its tables, colour as RGB.
Type sample_type(const DicomFile&);
int sample_channels(const DicomFile&);
/// Memory that decoding one frame takes beside the samples.
std::size_t decoding_bytes(const DicomFile&);

/// Frames of one DICOM file, decoded one at a time.
class DicomFrames {
 public:
    /// @throws InputError pixels of a kind that is not supported
    explicit DicomFrames(const DicomFile& file);

    /// x fastest, channels of a pixel together, native byte order; bits that are not stored are
    /// cleared or take the sign. Valid until the next call.
    std::span<const std::byte> frame(std::int64_t k);

 private:
    void read_plain(std::int64_t k);
    void decode(std::int64_t k);
    Bytes compressed(std::int64_t k, std::size_t most) const;
    std::pair<std::size_t, std::size_t> fragments_of(std::int64_t k) const;
    void find_starts();
    void clear_unused_bits();
    void put_channels_together();
    void to_rgb();
    void look_up();

    const DicomFile& file_;
    mutable DicomBytes bytes_;
    Bytes samples_;
    std::vector<std::size_t> starts_;  // first fragment of each frame, of several
    std::int64_t at_ = -1;
    bool planar_ = false;  // of samples_, on the way
    bool ybr_ = false;     // samples_ are luminance and differences of colour
};

}  // namespace edgewise::store
