// A folder of pictures of one size and type, in the numeric order of their names, as a volume.

#include <cstring>
#include <fmt/format.h>

#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

class StackReader : public Reader {
 public:
    explicit StackReader(std::vector<Header> planes) : planes_(std::move(planes)) {}
    void read(const Header&, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>& warnings) const override {
        const std::size_t bytes = into.size() / planes_.size();
        for (std::size_t i = 0; i < planes_.size(); ++i)
            planes_[i].reader->read(planes_[i], pick, into.subspan(i * bytes, bytes), warnings);
    }

    std::optional<std::vector<std::string>> files() const override {
        std::vector<std::string> all;
        for (const Header& plane : planes_) {
            const auto files = files_of(plane);
            if (!files) return std::nullopt;
            all.insert(all.end(), files->begin(), files->end());
        }
        return all;
    }

 private:
    std::vector<Header> planes_;
};

}  // namespace

Header inspect_stack(const std::string& folder, const std::vector<std::string>& pictures) {
    std::vector<Header> planes;
    for (const std::string& picture : pictures) {
        planes.push_back(inspect(picture));
        Header& plane = planes.back();
        const Header& first = planes[0];
        if (plane.volume)
            refuse(folder,
                   in_quotes(picture) + " holds several pages, expected one picture a file");
        if (plane.extent != first.extent || plane.channels != first.channels ||
            plane.type != first.type)
            refuse(folder, fmt::format("pictures of a stack must be alike: '{}' is {} x {} x {} "
                                       "{}, '{}' {} x {} x {} {}",
                                       first.file, first.extent.x, first.extent.y, first.channels,
                                       name_of(first.type), plane.file, plane.extent.x,
                                       plane.extent.y, plane.channels, name_of(plane.type)));
        plane.exif.clear();
        plane.icc.clear();
        plane.png_chunks.clear();
    }
    Header header = planes[0];
    header.file = folder;
    header.volume = true;
    header.colour = header.channels >= 3;
    header.extent.z = static_cast<std::int64_t>(planes.size());
    header.warnings.clear();
    if (!header.unit.empty())
        header.warnings.push_back(
            message("{}: its pictures are taken to be as far apart as columns, which they do not "
                    "say; @input_spacing says otherwise",
                    folder));
    header.reader = std::make_shared<const StackReader>(std::move(planes));
    return header;
}

}  // namespace edgewise::store
