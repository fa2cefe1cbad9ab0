#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/message.hpp"
#include "graph/request.hpp"

namespace edgewise {

/// What the values of a transfer function's points are.
enum class TransferValues {
    data,        // values as the file means them
    hounsfield,  // the same, of a CT; data that are shifted by 1024 are recognised
    window,      // shares: 0 and 1 are the ends of robust_window()
    range,       // shares: 0 and 1 are the least and the greatest value of the data
    labels,      // of the last point each label but 0 has the opacity, in a colour of its own
};
const char* name_of(TransferValues values) noexcept;

/// A transfer function as a file or a preset has it, before the data are known.
struct TransferSpec {
    Transfer transfer;
    bool unit_given = false;  // else its opacities are per smallest spacing of the input
    /// The unit is for a patient's scan, and shrinks with the structures of smaller objects: see
    /// size_share().
    bool by_size = false;
    TransferValues values = TransferValues::data;
    std::optional<Material> material = {};  // where light falls and the request names none
    Message from = setting("transfer");     // what messages call it
    std::string preset = {};                // its name; "": it is a file's
    std::vector<Message> warnings = {};     // what of its file is left out
};

}  // namespace edgewise
