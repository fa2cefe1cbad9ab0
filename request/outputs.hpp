#pragma once

#include <optional>
#include <string>

#include "io/store.hpp"
#include "request/query.hpp"

namespace edgewise {

/// -o OUT: one file, one file a frame, standard output ("-", a PNG), or nothing ("null:").
class Outputs {
 public:
    enum class Holds { samples, surface };
    /// @throws RequestError a folder that is not there or cannot be written, an ending that no
    ///         format has, a number pattern other than %d, %04d and %%, a film without encoder
    /// @param encoder  see Query::film_encoder
    explicit Outputs(const std::string& pattern, Holds holds = Holds::samples,
                     const std::string& encoder = {});

    bool none() const noexcept { return none_; }
    bool numbered() const noexcept { return numbered_; }
    /// Of files that hold samples.
    const store::Format& format() const noexcept { return *format_; }
    /// The file of a frame, from 0.
    std::string file(int frame) const;
    /// Whether so many frames become one file that shows them one after another.
    bool animates(int frames) const noexcept {
        return frames > 1 && !none() && !numbered_ && pattern_ != "-" && format_->frames;
    }
    /// See Query::film_encoder.
    const std::string& encoder() const noexcept { return encoder_; }
    /// @throws RequestError several frames and no place for their number
    void expect_frames(int frames) const;

 private:
    std::string pattern_, encoder_, before_, after_;
    bool none_ = false, numbered_ = false;
    int digits_ = 0;
    char fill_ = ' ';
    const store::Format* format_ = nullptr;
};

/// Where a query's results go, or nothing: it names no file. @throws RequestError as Outputs does
std::optional<Outputs> outputs_of(const Query& query);

/// @throws RequestError the folder of a file is not there or cannot be written
/// @param option  what messages call the file
void expect_writable(const Message& option, const std::string& file);

/// Writes text (a report, a graph), "-" is standard output; a file is replaced when whole.
/// @throws RunError
void write_text(const std::string& file, const std::string& text);

}  // namespace edgewise
