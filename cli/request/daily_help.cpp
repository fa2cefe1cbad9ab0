#include "cli/request/daily_help.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <string>
#include <string_view>
#include <vector>

namespace edgewise::cli {
namespace {

struct Line {
    std::string_view option;  // as it is typed, with its value
    std::string_view means;
};

struct Page {
    std::string_view verb, usage, about;
    std::array<std::string_view, 5> examples;
    std::vector<Line> lines;
};

/// What all verbs have.
const std::vector<Line> kEverywhere = {
    {"--max-error E", "how good: 1%, 0.01 or 40dB; without it as good as linear interpolation"},
    {"--max-time T", "how fast: the best picture in 50ms, 2s, 1min"},
    {"--max-memory M", "peak of the process: 512MiB, 2GB"},
    {"--explain", "the plan, why it was chosen, and what else there is"},
    {"--verify", "measures the error that was made"},
};

const std::vector<Page> kPages = {
    {"render",
     "edgewise render FILE -o OUT [options]",
     "Makes pictures of a volume: a file, a folder of slices or of DICOM, phantom:NAME:N.",
     {"edgewise render head.nii.gz -o head.png --mode shaded",
      "edgewise render ct/ -o front.png --view front --mode shaded --preset ct-bone",
      "edgewise render stack.tif -o turn.gif --turntable 36 --size 480",
      "edgewise render ct/ -o lungs.png --mode surface --isovalue -500 --view front",
      "edgewise render ct/ -o radiograph.png --mode drr --view front --max-time 100ms"},
     {{"-o OUT", "a picture (.png .jpg .tif; %d: several), a film (.gif), values (.nrrd)"},
      {"--mode MODE", "mip (default), shaded, composite, surface, xray, drr, mean, minip"},
      {"--preset NAME", "colours and opacities, as `edgewise list presets` has them"},
      {"--isovalue V", "of surface and binary: where values reach V"},
      {"--window LO,HI", "black and white: values, 1%,99%, W400L40; of a CT lung, bone, soft"},
      {"--background R,G,B", "0 to 1, default black; none: alpha is kept"},
      {"--light X,Y,Z", "towards a light: x right, y down, z away from you"},
      {"--view SIDE", "front, back, left, right, top, bottom"},
      {"--rotate X,Y,Z", "degrees about x, then y, then z"},
      {"--turntable N", "N views around the body"},
      {"--perspective DEG", "vertical angle of view; without it rays are parallel"},
      {"--zoom Z", "more than 1 shows less, larger"},
      {"--size WxH or N", "pixels; N: of the longer side"},
      {"--clip X0,Y0,Z0,X1,Y1,Z1", "keeps the box of these samples"},
      {"--slab T", "keeps T of the file's unit about the middle"},
      {"--channel N, --time N",
       "one of several; several channels: 0=red,1=green; all times: a film"},
      {"--labels", "the samples are labels: colours of segments, no values between them"},
      {"--colormap NAME", "of mip, xray, mean: viridis, magma, hot ...; --legend shows its values"},
      {"--montage WxH", "frames or channels side by side; --scale-bar draws a length"}}},
    {"warp",
     "edgewise warp FILE -o OUT [options]",
     "Resamples an image or a volume: turned, scaled, moved, on another grid.",
     {"edgewise warp photo.png -o turned.png --rotate 30 --size fit",
      "edgewise warp photo.png -o small.png --scale 0.5",
      "edgewise warp head.nii.gz -o turned.nii.gz --rotate 20,0,0",
      "edgewise warp ct/ -o even.nrrd --spacing 2",
      "edgewise warp seg.nrrd -o moved.nrrd --labels --translate 2,0,0"},
     {{"-o OUT", "a picture or a volume; the format by its name"},
      {"--rotate A or X,Y,Z", "degrees about the centre"},
      {"--scale S[,S[,S]]", "more than 1 enlarges"},
      {"--translate T,T[,T]", "in the file's unit"},
      {"--shear xy=K,...", "adds K y to x"},
      {"--matrix NUMBERS|FILE", "any matrix, object to screen, row by row"},
      {"--about X,Y[,Z]", "the sample that is held fixed, in place of the centre"},
      {"--view SIDE", "of a volume: front, left, top ...; turned so that one looks along z"},
      {"--clip X0,Y0,Z0,X1,Y1,Z1", "crops: keeps these samples, ends included"},
      {"--spacing S[,S[,S]]", "distance of output samples"},
      {"--size WxH[xD], N or fit", "samples; N: of the longer side; fit: nothing is cut off"},
      {"--outside V", "the value beyond the input"},
      {"--labels", "the samples are labels: no value between them"},
      {"--bits 8|16|32", "type of the written samples"},
      {"--channel N, --time N", "one of several"}}},
    {"filter",
     "edgewise filter FILE -o OUT --op OP --kernel KERNEL [options]",
     "Convolves, correlates, dilates, erodes, opens, closes, takes medians of an image or a "
     "volume.",
     {"edgewise filter photo.png -o smooth.png --op convolve --kernel gauss:2",
      "edgewise filter head.nii.gz -o smooth.nii.gz --op convolve --kernel gauss:2mm",
      "edgewise filter stack.tif -o clean.tif --op median --kernel box:1",
      "edgewise filter head.nii.gz -o edges.nrrd --op gradient --kernel sobel --bits 32",
      "edgewise filter photo.png -o open.png --op open --kernel sphere:3"},
     {{"-o OUT", "a picture or a volume; the format by its name"},
      {"--op OP", "convolve correlate median dilate erode open close gradient ..."},
      {"--kernel KERNEL", "gauss:S box:R sphere:R sobel:x laplace, or a file; 2mm: a length"},
      {"--border WHERE", "beyond the edge: mirror (default), zero, clamp, wrap"},
      {"--slices", "slice by slice, with a kernel of two axes"},
      {"--bits 8|16|32", "type of the written samples"},
      {"--channel N, --time N", "one of several; all times: a series"}}},
    {"mesh",
     "edgewise mesh FILE -o OUT --isovalue V|--labels [options]",
     "Makes surfaces of triangles: where values reach a level, or around each label.",
     {"edgewise mesh ct/ -o bone.stl --isovalue 300",
      "edgewise mesh head.nii.gz -o skin.ply --isovalue 60",
      "edgewise mesh seg.nrrd -o organs.ply --labels",
      "edgewise mesh seg.nrrd -o voxels.ply --labels --smooth 0",
      "edgewise mesh head.nii.gz -o null: --isovalue 60 --json -"},
     {{"-o OUT", "a mesh (.stl .ply .obj .vtp ...)"},
      {"--isovalue V", "where values reach V"},
      {"--labels", "a surface around each label, closed"},
      {"--smooth 0..1", "of labels: 0 keeps the samples' steps"},
      {"--largest", "the largest part alone"},
      {"--decimate F", "leaves out this share of the triangles"},
      {"--json FILE", "counts, area, volume, whether it is closed; -: standard output"}}},
    {"radon",
     "edgewise radon FILE -o OUT --angles N|A,B,... [options]",
     "Integrals along lines of an image (its sinogram), Hough votes, and the way back.",
     {"edgewise radon photo.png -o sinogram.nrrd --angles 180 --bits 32",
      "edgewise radon photo.png -o three.nrrd --angles 0,30,60 --bits 32",
      "edgewise radon sinogram.nrrd -o back.png --inverse",
      "edgewise radon photo.png -o null: --angles 90 --verify",
      "edgewise radon photo.png -o sinogram.png --angles 360"},
     {{"-o OUT", "a picture or an array; the format by its name"},
      {"--angles N|A,B,...", "so many, even over 180 degrees; or these"},
      {"--inverse", "an image from its sinogram, by filtered back projection"},
      {"--bits 8|16|32", "type of the written samples"}}},
};

std::string text_of(const std::vector<Line>& lines) {
    std::string text;
    for (const Line& line : lines) text += fmt::format("  {:<26} {}\n", line.option, line.means);
    return text;
}

/// Of what all verbs have, what this one has too.
std::vector<Line> everywhere(const CLI::App& app) {
    std::vector<Line> lines;
    for (const Line& line : kEverywhere) {
        const std::string name(line.option.substr(0, line.option.find(' ')));
        if (app.get_option_no_throw(name)) lines.push_back(line);
    }
    return lines;
}

std::string text_of(const Page& page, const CLI::App& app) {
    return fmt::format("{}\n\nUsage: {}\n\n  {}\n\n{}\n{}\n--help-all lists all options.\n",
                       page.about, page.usage, fmt::join(page.examples, "\n  "),
                       text_of(page.lines), text_of(everywhere(app)));
}

class DailyHelp final : public CLI::Formatter {
 public:
    std::string make_help(const CLI::App* app, std::string name,
                          CLI::AppFormatMode mode) const override {
        const auto page = std::find_if(kPages.begin(), kPages.end(), [&](const Page& each) {
            return each.verb == app->get_name();
        });
        if (mode == CLI::AppFormatMode::Normal && page != kPages.end()) return text_of(*page, *app);
        return CLI::Formatter::make_help(app, std::move(name), CLI::AppFormatMode::Normal);
    }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> daily_help() { return std::make_shared<DailyHelp>(); }

}  // namespace edgewise::cli
