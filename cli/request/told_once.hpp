#pragma once

#include <string>
#include <vector>

#include "graph/message.hpp"
#include "request/input.hpp"

namespace edgewise::cli {

/// Which of the warnings about files earlier commands have told, kept in a folder: a file's, for as
/// long as it stays as it is and this version tells them. Where nothing can be kept, all are new.
class ToldOnce {
 public:
    explicit ToldOnce(std::string folder) : folder_(std::move(folder)) {}

    struct Sorted {
        std::vector<Message> told, untold;
        bool first = false;  // of the file: from now on it is kept what was told
    };
    /// Keeps that all are told now.
    Sorted sort(const Input& file, const std::vector<Message>& warnings) const;

 private:
    std::string folder_;
};

}  // namespace edgewise::cli
