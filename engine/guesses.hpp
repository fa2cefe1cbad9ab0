#pragma once

#include <optional>

namespace edgewise {

struct Opened;
struct Looked;
class Listener;

// What a request leaves open and the data do not say is guessed; here it is said.

/// A view of the body where the file does not say how it lies in it.
void say_where_front_is(const Opened& opened, Listener& messages);

/// Samples of the output that lie farther apart than those of the input, which are read where the
/// output's are and nowhere else.
void say_what_is_reduced(const Opened& opened, Listener& messages);

/// Whether rays go along the file's own z because neither file nor request says otherwise.
bool looks_along_z(const Opened& opened);

/// Puts in what lies beyond the input of a warp where nobody says it: air of a CT in Hounsfield
/// units, where some output sample is there.
void take_outside(Looked& looked);

/// The value of the output samples of a warp that lie beyond the input; absent: there are none.
std::optional<double> filled_with(const Opened& opened);

/// That the file's type cannot hold that value.
void say_what_fills(const Opened& opened, Listener& messages);

}  // namespace edgewise
