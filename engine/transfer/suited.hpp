#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/transfer/transfer_spec.hpp"
#include "graph/data.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// A transfer function of the values that some data have.
struct Suited {
    Transfer transfer;
    std::vector<std::string> warnings;
};

/// Turns shares into values, and Hounsfield units into what the data have in their place.
/// @param spacing  the smallest of the data: what opacities are for that name no length
Suited suited(const TransferSpec& spec, const Data& data, const Statistics& statistics,
              double spacing);

/// A colour for each label but 0, opaque: the same as the preset for labels has, of up to 4096
/// labels.
/// @param from  what asks for them
/// @throws RequestError where values are no whole numbers, or more
Suited label_colors(const std::string& from, const Data& data, const Statistics& statistics);

/// The preset for data of which nobody said how they are to look: of a CT in Hounsfield units
/// "ct-bone", of all else "general".
/// @param modality  as DICOM has it; "": not known
std::string suiting_preset(const Data& data, const Statistics& statistics,
                           const std::string& modality);

}  // namespace edgewise
