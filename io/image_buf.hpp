#pragma once

#include <OpenImageIO/imagebuf.h>
#include <memory>

#include "graph/data.hpp"

namespace edgewise::store {

// Pictures and volumes of programs that use OpenImageIO, in and out without a copy. This is a
// library of its own (edgewise::image_buf), since OpenImageIO takes 0.4 s to start.
//
// Samples are taken as they are. No orientation, colour space or ValueMap is applied, and colours
// are not multiplied by alpha or divided by it: OpenImageIO keeps them multiplied (premultiplied),
// which is what a filter needs, and whoever made a buffer of straight alpha multiplies first
// (OIIO::ImageBufAlgo::premult).

/// The pixels of a buffer as data in object space. Pixels with gaps between them, in another order
/// than row by row from the top, or not aligned to their type are copied: the data then have an
/// address of their own. Sample (0, 0, 0) is the first of the buffer's
/// data window, whatever its display window. The buffer lives as long as the data, and must not be
/// written, reset or moved from meanwhile. No memory budget counts the samples: they belong in
/// PlanOptions::pinned.
/// @throws InputError why it cannot be shared: deep, not in memory of its own (in a cache), of
///     another type than u8, i8, u16, i16 and f32, or with more than 4 channels
std::shared_ptr<const Data> data_of(std::shared_ptr<const OIIO::ImageBuf> image);

/// Samples as a buffer that wraps them and keeps the data alive; its copies wrap the same samples
/// but do not keep them. Of a box, the data window is the box and the display window is the whole.
/// @throws InputError samples that are not linear in memory, or complex
std::shared_ptr<const OIIO::ImageBuf> image_buf_of(std::shared_ptr<const Data> data);
/// One that may be written, to fill data that nobody reads yet.
std::shared_ptr<OIIO::ImageBuf> image_buf_of(std::shared_ptr<Data> data);

}  // namespace edgewise::store
