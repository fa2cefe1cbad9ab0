#include <algorithm>
#include <cmath>

#include "graph/errors.hpp"
#include "presentation/canvas.hpp"

#ifdef EDGEWISE_FONT
#include <ft2build.h>
#include FT_FREETYPE_H

// The font is part of the library, so that pictures hang on no folder of the machine.
__asm__(
    ".pushsection .rodata\n"
    ".global edgewise_font\n"
    ".global edgewise_font_end\n"
    "edgewise_font: .incbin \"" EDGEWISE_FONT
    "\"\n"
    "edgewise_font_end: .byte 0\n"
    ".popsection\n");
extern "C" const unsigned char edgewise_font[];
extern "C" const unsigned char edgewise_font_end[];
#endif

namespace edgewise {

#ifdef EDGEWISE_FONT
namespace {

/// The font at one size.
class Face {
 public:
    explicit Face(double height) {
        if (FT_Init_FreeType(&library_) != 0 ||
            FT_New_Memory_Face(library_, edgewise_font,
                               static_cast<FT_Long>(edgewise_font_end - edgewise_font), 0,
                               &face_) != 0)
            throw RunError("FreeType does not open the font that it came with");
        // Capitals of DejaVu Sans are 0.729 of its size.
        constexpr double kCapital = 0.729;
        FT_Set_Char_Size(face_, 0, std::lround(64 * height / kCapital), 72, 72);
    }
    ~Face() {
        FT_Done_Face(face_);
        FT_Done_FreeType(library_);
    }
    Face(const Face&) = delete;
    Face& operator=(const Face&) = delete;

    /// Calls visit(bitmap, left, top) for each letter; top counts upwards from the line.
    /// @return the width
    template <class Visit>
    int for_each(const std::string& text, Visit visit) {
        FT_Pos at = 0;
        FT_UInt before = 0;
        for (std::size_t i = 0; i < text.size();) {
            const FT_UInt glyph = FT_Get_Char_Index(face_, next(text, i));
            FT_Vector apart{0, 0};
            FT_Get_Kerning(face_, before, glyph, FT_KERNING_DEFAULT, &apart);
            at += apart.x;
            if (FT_Load_Glyph(face_, glyph, FT_LOAD_RENDER | FT_LOAD_NO_HINTING) == 0) {
                const FT_GlyphSlot slot = face_->glyph;
                visit(slot->bitmap, static_cast<int>((at + 32) >> 6) + slot->bitmap_left,
                      slot->bitmap_top);
                at += slot->advance.x;
            }
            before = glyph;
        }
        return static_cast<int>((at + 63) >> 6);
    }

 private:
    /// The letter there, of UTF-8, and on to the next.
    static FT_ULong next(const std::string& text, std::size_t& i) {
        const auto byte = [&](std::size_t k) {
            return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U;
        };
        const unsigned first = byte(i++);
        const unsigned more = first >= 0xf0 ? 3 : first >= 0xe0 ? 2 : first >= 0xc0 ? 1 : 0;
        FT_ULong letter = more == 0 ? first : first & (0x3fU >> more);
        for (unsigned k = 0; k < more; ++k) letter = letter << 6 | (byte(i++) & 0x3f);
        return letter;
    }

    FT_Library library_ = nullptr;
    FT_Face face_ = nullptr;
};

}  // namespace

bool can_draw_text() noexcept { return true; }

TextSize text_size(const std::string& text, double height) {
    Face face(height);
    TextSize size;
    size.width = face.for_each(text, [&](const FT_Bitmap& bitmap, int, int top) {
        size.above = std::max(size.above, top);
        size.below = std::max(size.below, static_cast<int>(bitmap.rows) - top);
    });
    return size;
}

void draw_text(Canvas& canvas, int x, int y, const std::string& text, double height,
               const Canvas::Colour& colour) {
    Face face(height);
    face.for_each(text, [&](const FT_Bitmap& bitmap, int left, int top) {
        for (unsigned row = 0; row < bitmap.rows; ++row)
            for (unsigned column = 0; column < bitmap.width; ++column)
                canvas.blend(
                    x + left + static_cast<int>(column), y - top + static_cast<int>(row), colour,
                    bitmap.buffer[row * static_cast<unsigned>(bitmap.pitch) + column] / 255.0);
    });
}
#else
namespace {
[[noreturn]] void refuse_text() {
    throw RunError("this build cannot draw text: it was made without FreeType and DejaVu Sans");
}
}  // namespace

bool can_draw_text() noexcept { return false; }
TextSize text_size(const std::string&, double) { refuse_text(); }
void draw_text(Canvas&, int, int, const std::string&, double, const Canvas::Colour&) {
    refuse_text();
}
#endif

}  // namespace edgewise
