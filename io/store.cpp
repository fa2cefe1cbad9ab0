#include "io/store.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"
#include "io/tiff_directory.hpp"
#include "io/zarr.hpp"

namespace edgewise::store {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kMrcEndings{".mrc", ".mrcs", ".rec", ".map", ".ccp4", ".st", ".ali"};

/// Whether a folder of such files is a volume.
bool is_picture(const std::string& path) {
    const Format* format = format_of(path);
    return format && format->reads && format->images &&
           (!format->volumes || format->name == "TIFF");
}

Header inspect_folder(const std::string& path, const Selection& pick) {
    std::vector<std::string> pictures;
    bool dicom = false;
    for (const auto& entry : fs::directory_iterator(path)) {
        if (!entry.is_regular_file() || entry.path().filename().string().starts_with('.')) continue;
        const std::string file = entry.path().string();
        if (is_picture(file))
            pictures.push_back(file);
        else
            dicom = dicom || is_dicom(file);
    }
    if (dicom) return inspect_dicom(path, pick);
    if (pictures.empty()) refuse(path, "is a folder with neither DICOM files, pictures nor Zarr");
    std::sort(pictures.begin(), pictures.end(), numeric_less);
    return inspect_stack(path, pictures);
}

/// By the first bytes where these are clear, for files whose ending says nothing.
Header inspect_by_content(const std::string& path, const Selection& pick) {
    const Bytes head = File(path).head(212);
    const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
    if (text.empty()) refuse(path, "the file is empty");
    if (text.starts_with("\x89PNG")) return inspect_png(path);
    if (text.starts_with("\xff\xd8\xff")) return inspect_jpeg(path);
    if (is_tiff(head)) return inspect_tiff(path, pick);
    if (text.starts_with("NRRD000")) return inspect_nrrd(path);
    if (text.starts_with("# vtk DataFile")) return inspect_vtk(path);
    if (is_dicom(path)) return inspect_dicom(path, {});
    // Files from before the year 2000 have no mark.
    if (is_mrc(head) || ends_with_any(path, kMrcEndings)) return inspect_mrc(path);
    if (ends_with_any(path, {".gipl", ".gipl.gz"})) return inspect_by_itk(path);
    if (const auto library = library_format(head); !library.empty())
        return inspect_by_oiio(path, std::string(library));
    if (const Format* format = format_of(path); format && !format->library.empty())
        return inspect_by_oiio(path, format->library);
    refuse(path, "its format is not known, by its ending or its first bytes");
}

Header inspect_file(const std::string& path, const Selection& pick) {
    const Bytes head = File(path).head(4);
    if (head.empty()) refuse(path, "the file is empty");
    const bool radiance = head.size() > 1 && head[0] == std::byte{'#'} && head[1] == std::byte{'?'};
    if (ends_with_any(path, {".nii", ".nii.gz", ".img", ".img.gz", ".hdr.gz"}))
        return inspect_nifti(path);
    if (ends_with_any(path, {".hdr"}) && !radiance) return inspect_nifti(path);
    if (ends_with_any(path, {".nrrd", ".nhdr"})) return inspect_nrrd(path);
    if (ends_with_any(path, {".mha", ".mhd"})) return inspect_metaimage(path);
    if (ends_with_any(path, {".mgh", ".mgz", ".mgh.gz"})) return inspect_mgh(path);
    if (ends_with_any(path, {".vtk"})) return inspect_vtk(path);
    if (ends_with_any(path, {".vti"})) return inspect_vti(path);
    if (ends_with_any(path, {".json"})) return inspect_json(path);
    if (ends_with_any(path, {".dcm", ".dicom", ".ima"})) return inspect_dicom(path, pick);
    if (ends_with_any(path, {".exr"})) return inspect_by_oiio(path, "openexr");
    return inspect_by_content(path, pick);
}

void check_times(const Header& header, const Selection& pick) {
    if (pick.time && (*pick.time < 0 || *pick.time >= header.times))
        throw RequestError(message("{}: @time({}): it holds time points 0 to {}", header.file,
                                   *pick.time, header.times - 1));
    if (pick.channel && (*pick.channel < 0 || *pick.channel >= header.channels))
        throw RequestError(message("{}: @channel({}): it holds channels 0 to {}", header.file,
                                   *pick.channel, header.channels - 1));
    if (!pick.time && header.times > 1)
        throw RequestError(message("{}: holds {} time points, choose one with @time 0 ... {}",
                                   header.file, header.times, header.times - 1));
    if (!pick.channel && header.channels > 4)
        throw RequestError(message("{}: holds {} channels, choose one with @channel 0 ... {}",
                                   header.file, header.channels, header.channels - 1));
}

}  // namespace

Header inspect(const std::string& source, const Selection& pick) {
    Header header;
    std::error_code error;
    if (source.starts_with("raw:")) {
        header = inspect_raw(source);
    } else if (is_zarr(source)) {
        header = inspect_zarr(source, pick);
    } else if (!fs::exists(source, error)) {
        refuse(source, error ? error.message() : "does not exist");
    } else if (fs::is_directory(source, error)) {
        header = inspect_folder(source, pick);
    } else {
        header = inspect_file(source, pick);
    }
    if (pick.level.value_or(0) != header.level)
        throw RequestError(
            message("{}: @level({}): it holds one resolution, 0", source, *pick.level));
    if (!pick.orient.empty()) {
        const auto direction = direction_of(pick.orient);
        if (!direction)
            throw RequestError(
                message("@orient '{}': expected three letters, one of each pair RL, AP, SI",
                        shown(pick.orient)));
        header.direction = *direction;
        header.anatomical = true;
    }
    if (header.anatomical) header.orientation = letters_of(header.direction);
    override_spacing(header, pick);
    return header;
}

Type loaded_type(Type stored, bool as_stored) noexcept {
    const bool wide = stored == Type::f64 || stored == Type::i32 || stored == Type::u32;
    return stored == Type::f16 || (wide && !as_stored) ? Type::f32 : stored;
}

int loaded_channels(const Header& header, const Selection& pick) noexcept {
    return pick.channel ? 1 : header.channels;
}

std::size_t loaded_bytes(const Header& header, const Selection& pick) {
    check_times(header, pick);
    const std::size_t bytes = static_cast<std::size_t>(header.extent.samples()) *
                              static_cast<std::size_t>(loaded_channels(header, pick)) *
                              bytes_of(loaded_type(header.type, pick.as_stored));
    if (pick.memory_limit > 0 &&
        (bytes > pick.memory_limit || header.reading_bytes > pick.memory_limit - bytes))
        refuse(header.file, fmt::format("needs {} bytes for {} x {} x {} samples and {} for "
                                        "reading them, more than the limit of {}",
                                        bytes, header.extent.x, header.extent.y, header.extent.z,
                                        header.reading_bytes, pick.memory_limit));
    return bytes;
}

std::vector<Message> read_samples(const Header& header, const Selection& pick, void* into,
                                  std::size_t bytes) {
    if (bytes != loaded_bytes(header, pick))
        throw RequestError(fmt::format("{}: {} bytes to read into, expected {}", header.file, bytes,
                                       loaded_bytes(header, pick)));
    std::vector<Message> warnings;
    header.reader->read(header, pick, {static_cast<std::byte*>(into), bytes}, warnings);
    return warnings;
}

PaddingRuns padding_runs(const Header& header, const Selection& pick) {
    return header.reader ? header.reader->padding(header, pick) : PaddingRuns{};
}

std::optional<std::vector<std::string>> files_of(const Header& header) {
    std::optional<std::vector<std::string>> files = header.reader->files();
    if (files && !header.file.starts_with("raw:")) files->push_back(header.file);
    return files;
}

Loaded load(const std::string& source, const Selection& pick, std::pmr::memory_resource* from) {
    Loaded loaded{inspect(source, pick), {}};
    Header& header = loaded.header;
    loaded.samples = Array(loaded_bytes(header, pick), from);
    for (Message& warning :
         read_samples(header, pick, loaded.samples.data(), loaded.samples.bytes()))
        header.warnings.push_back(std::move(warning));
    Type type = loaded_type(header.type, pick.as_stored);
    if (!pick.bits64) {
        if (header.integers != Wide::no)
            narrow_wide(header, type, loaded.samples, from, header.warnings);
        header.integers = Wide::no;
    }
    header.channels = loaded_channels(header, pick);
    header.type = type;
    header.times = 1;
    if (pick.channel) header.alpha = Alpha::none;
    return loaded;
}

void write(const std::string& path, const Header& what, const void* samples,
           const WriteOptions& options) {
    const Format* format = format_of(path);
    if (const std::string why = cannot_write(path, what); !why.empty())
        throw RequestError(path + ": " + why);
    Bytes changed;
    if (!format->library.empty()) changed = with_alpha_of(*format, what, samples);
    if (!changed.empty()) samples = changed.data();
    Replacement out(path);
    if (format->name == "NIfTI") write_nifti(out, what, samples);
    if (format->name == "NRRD") write_nrrd(out, what, samples);
    if (format->name == "MetaImage") write_metaimage(out, what, samples);
    if (format->name == "MGH") write_mgh(out, what, samples);
    if (format->name == "PNG" || format->name == "APNG") write_png(out, what, samples);
    if (format->name == "JPEG") write_jpeg(out, what, samples, options.quality.value_or(95));
    if (format->name == "TIFF") write_tiff(out, what, samples);
    if (format->name == "PNM" || format->name == "PFM")
        write_pnm(out, what, samples);
    else if (format->name == "SGI")
        write_sgi(out, what, samples);
    else if (format->name == "GIF")
        write_gif(out, what, samples);
    else if (!format->library.empty())
        write_by_oiio(out, *format, what, samples, options.quality.value_or(0));
    out.commit();
}

}  // namespace edgewise::store
