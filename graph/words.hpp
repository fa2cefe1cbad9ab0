#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace edgewise {

/// ASCII letters in lower case, all else as it is.
std::string lower(std::string_view text);
/// Whether two words differ in the case of their letters only.
bool same_word(std::string_view a, std::string_view b);

/// The one of some names that someone may have meant by a word that is none of them: the least
/// number of letters added, left out, exchanged or swapped with the next, within two fifths of the
/// word; or one that the word begins. "" where none is close.
std::string nearest_name(std::string_view word, const std::vector<std::string>& names);

/// What to say of a word that is none of some names: "did you mean NAME?", or all names where none
/// is close and they are few, or else `otherwise` (how to see them all).
std::string instead_of(std::string_view word, const std::vector<std::string>& names,
                       std::string_view otherwise = {});

}  // namespace edgewise
