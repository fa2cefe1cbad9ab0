#include "engine/only_labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "graph/with_type.hpp"

namespace edgewise {
namespace {

/// The integer that a stored number stands for, where it is one.
std::optional<std::int64_t> label_of(double number, const Input& input) {
    const double value = input.data->what.values(number);
    if (const LabelTable* table = input.table.get()) {
        if (!(value >= 0)) return {};
        return table->integer(static_cast<std::size_t>(value));
    }
    if (value != std::floor(value) || !(std::abs(value) < 0x1p63)) return {};
    return static_cast<std::int64_t>(value);
}

}  // namespace

Message keep_labels(Input& input, const std::vector<std::int64_t>& labels, double background,
                    std::pmr::memory_resource* memory) {
    auto data = std::make_shared<Data>(Data::make(input.data->what, memory));
    std::vector<bool> found(labels.size());
    const ValueMap& values = data->what.values;
    const double outside = input.table ? place_in(*input.table, input.outside) : background;
    const auto count = static_cast<std::size_t>(data->what.samples() * data->what.channels);
    with_type(data->what.type, [&]<class T>(T) {
        const T* from = input.data->as<T>();
        T* to = data->as<T>();
        const T none = static_cast<T>((outside - values.offset) / values.slope);
        bool kept = false;
        for (std::size_t i = 0; i < count; ++i) {
            // Neighbours are mostly equal.
            if (i == 0 || std::memcmp(from + i, from + i - 1, sizeof(T)) != 0) {
                const auto label = label_of(static_cast<double>(from[i]), input);
                const auto at =
                    label ? std::find(labels.begin(), labels.end(), *label) : labels.end();
                kept = at != labels.end();
                if (kept) found[static_cast<std::size_t>(at - labels.begin())] = true;
            }
            to[i] = kept ? from[i] : none;
        }
    });
    std::vector<std::int64_t> missing;
    for (std::size_t i = 0; i < labels.size(); ++i)
        if (!found[i]) missing.push_back(labels[i]);
    if (missing.size() == labels.size())
        throw RequestError(message("@labels({}): no sample of {} is one of them",
                                   fmt::join(labels, ","), input.name));
    input.data = std::move(data);
    input.identity.reset();  // these are no longer the file's samples
    if (missing.empty()) return "";
    return message("@labels: no sample of {} is {}", input.name, fmt::join(missing, " or "));
}

}  // namespace edgewise
