#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <unordered_map>

#include "graph/data.hpp"
#include "io/labels.hpp"
#include "io/store.hpp"
#include "reference/phantoms.hpp"
#include "request/describe.hpp"
#include "request/geometry.hpp"
#include "request/input_identity.hpp"

namespace edgewise {

/// What of the samples has to outlive the way into memory and out again.
enum class Keep {
    values,  // as far as f32 has digits; straight colour is multiplied by its alpha
    labels,  // which is which: what f32 cannot hold is coded by a table
    bits,    // everything: samples are only moved
};

/// What FILE stands for: first its description, then its samples.
struct Input {
    std::string name;  // as it was typed
    store::Header header;
    store::Selection selection;
    std::optional<Phantom> phantom;
    std::optional<Described> described;
    /// Of k-space: pairs of f32, from which the volume that `header` says is made. Absent: `header`
    /// is of what is read.
    std::optional<store::Header> pairs;
    Keep keep = Keep::values;
    double outside = 0;                       // labels: the value beyond the input
    std::shared_ptr<const LabelTable> table;  // that samples are places in; absent: they are values
    std::shared_ptr<const Data> data;
    double read_seconds = 0;
    std::chrono::system_clock::time_point inspected_at{};
    std::optional<InputIdentity> identity;  // of the samples as they were read; absent: not sure

    int channels() const noexcept { return store::loaded_channels(header, selection); }
    /// Straight colour is multiplied by its alpha before it is interpolated.
    bool premultiplied() const noexcept;
    /// One channel of a colour is multiplied by its alpha.
    bool by_alpha() const noexcept;
    /// The stored alpha that is opaque.
    double opaque() const noexcept;
    /// Bytes of the samples in memory.
    double bytes() const;
};

/// What the file says of the labels that its samples are, or are places of.
class Segments {
 public:
    explicit Segments(const Input& input);
    /// Of a value of the samples; null: nothing.
    const store::Segment* of(double value) const;

 private:
    const LabelTable* table_;
    std::unordered_map<std::int64_t, const store::Segment*> by_label_;
};

/// Reads the description. @throws InputError, RequestError
Input inspected(const std::string& name, const store::Selection& selection);
/// The description of samples that a program brings. @throws RequestError
Input given_input(const Data& data, const store::Selection& selection);
/// Samples that a program brings in place of those that `input` describes: as many, of any type.
/// @throws RequestError
void expect_given(const Data& data, const Input& input);
/// What memory holds before anything is read: the stored type where bits are kept.
Representation stored_as(const Input& input);
/// How the samples are to be read.
void take_keep(Input& input, Keep keep);
/// Reads the samples. @throws InputError, RequestError, std::bad_alloc
/// @return warnings
std::vector<Message> read_data(Input& input, std::pmr::memory_resource* memory);

/// The same of what was described: a representation without samples.
std::shared_ptr<const Data> described_data(const Input& input);

InputGrid grid_of(const Input& input);

}  // namespace edgewise
