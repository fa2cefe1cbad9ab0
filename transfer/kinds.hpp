#pragma once

#include <span>
#include <string>

#include "graph/data.hpp"
#include "transfer/robust_window.hpp"

namespace edgewise {

/// Of a window: beyond noise of the background, and what lies half in a body.
inline constexpr double kBody = 0.1;

/// What a file says of its samples, as far as it matters to how they are to look.
struct FileFacts {
    std::string modality;    // as DICOM has it; "": not said
    std::string format;      // "DICOM", "NIfTI" ...
    double millimetres = 0;  // in one unit of spacing; 0: nobody says
    int channels = 1;        // of the file, of which one is seen
    bool integers = false;   // as they are stored
    bool labels = false;     // they are labels, says the file or whoever asks
};

/// What is known of a volume when a preset is chosen for it: what its file says, and what a few
/// drawn samples tell. Shares are of 1.
struct Look {
    FileFacts file;
    Extent extent;
    Vec3 spacing = Vec3::Ones();  // [mm], where FileFacts::millimetres is known
    ValueWindow window;
    std::optional<double> hounsfield;  // what is to be added to have Hounsfield units
    bool like_labels = false;          // integers, few, which neighbours share or jump between
    double body = 0;                   // samples that are no background
    double bright = 0;                 // of all samples, those above 0.4 of the window
    double thin = 0;                   // of the bright, those beside others along x
    double middle = 0;                 // of the window, where the median of the body lies
    double spread = 0;                 // of the window, between the quartiles of the body
    double centre = 0;                 // of the middle third along each axis, the body
    double turns = 0;                  // of samples inside, extremes along x: noise has many
    int open_faces = 0;                // faces of the volume that hardly any of the body touches

    /// Of one axis [mm]; 0: not known.
    double side(int axis) const noexcept;
    double shortest() const noexcept;
    double longest() const noexcept;
};
Look look_of(const Data& data, const Statistics& statistics, const Vec3& spacing,
             const FileFacts& file, const Glance& glance);

/// What values a preset's shares are of.
enum class WindowRule {
    own,     // the preset's values are the data's, or Hounsfield units
    robust,  // see robust_window()
};

/// A kind of data, and how it is shown where nobody says.
struct Kind {
    const char* name;
    const char* what;  // "a CT in Hounsfield units"
    const char* preset;
    WindowRule window;
    bool (*is)(const Look&);
    bool is_of_labels = false;  // who wants to see them as such has to say so
};
/// In the order in which they are asked; the last is all data.
std::span<const Kind> kinds();
const Kind& kind_of(const Look& look);

/// Whether its gradients may be smoothed against noise: those of MR, but for angiograms, whose
/// vessels are as thin as what is softened.
bool is_mr_of_tissue(const Kind& kind, const FileFacts& file);

}  // namespace edgewise
