#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "graph/data.hpp"
#include "scene/statistics.hpp"
#include "transfer/robust_window.hpp"
#include "transfer/transfer_spec.hpp"

namespace edgewise {

/// A transfer function of the values that some data have.
struct Suited {
    Transfer transfer;
    std::vector<Message> warnings = {}, notices = {};
    ValueWindow window = {};  // the values that it is spread over
};

/// How small structures are beside those of a patient's scan: 1, 0.1, 0.01 ... A length between the
/// volume's extent and the distance of its samples stands for them, the geometric mean of the
/// middle side and the smallest spacing: 5 to 26 mm of scans of patients, 0.1 to 1 mm of micro-CT.
/// Powers of ten leave scans of patients as they are, and a volume whose lengths are a hundredth of
/// another's makes the same picture. Samples 0.3 mm apart or more are a patient's.
/// @param spacing  [mm]
double size_share(const Extent& extent, const Vec3& spacing) noexcept;

/// Turns shares into values, and Hounsfield units into what the data have in their place.
/// @param spacing      of the data; the smallest is what opacities are for that name no length
/// @param millimetres  in one unit of spacing; 1 where nobody says what it is
/// @param glance       at the data; null: taken here
Suited suited(const TransferSpec& spec, const Data& data, const Statistics& statistics,
              const Vec3& spacing, double millimetres, const Glance* glance = nullptr);

/// The colour of the label that is so many from the least, counted from 0, where nobody brings one:
/// as far from those before it as hues go.
std::array<double, 3> label_color(std::size_t number) noexcept;

/// A colour for each label, opaque, which other values near it have too: its own, or that which the
/// preset for labels has. Any number of any finite values.
/// @param outside  the value that is no label
/// @param own      the colour that somebody brings for a value, or none
/// @param from     what asks for them
Suited label_colors(const Message& from, const Data& data, double outside,
                    const std::function<std::optional<std::array<double, 3>>(double value)>& own);

}  // namespace edgewise
