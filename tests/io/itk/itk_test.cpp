// The same files read by ITK, which shares no line with our readers: samples, spacing, origin and
// direction must agree. Nothing here is built where ITK is not found.

#include <cmath>
#include <gtest/gtest.h>
#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageSeriesReader.h>
#include <itkJPEGImageIO.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkPNGImageIO.h>
#include <itkTIFFImageIO.h>
#include <itkVTKImageIO.h>

#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;
using Volume = itk::Image<float, 3>;

/// Values as the file means them, in f32: ITK applies slope and intercept itself.
std::vector<float> values_of(const Loaded& got) {
    const Header& header = got.header;
    std::vector<float> values;
    const auto take = [&](auto zero) {
        for (const auto stored : samples_of<decltype(zero)>(got))
            values.push_back(static_cast<float>(header.values.slope * static_cast<double>(stored) +
                                                header.values.offset));
    };
    switch (header.type) {
        case Type::u8:
            take(std::uint8_t{});
            break;
        case Type::i8:
            take(std::int8_t{});
            break;
        case Type::u16:
            take(std::uint16_t{});
            break;
        case Type::i16:
            take(std::int16_t{});
            break;
        default:
            take(float{});
            break;
    }
    return values;
}

struct Compare {
    bool geometry = true;
    std::size_t samples = std::size_t(-1);  // at most so many are compared
};

void expect_equal(const std::string& path, const Volume& theirs, const Compare& what = {}) {
    const Loaded got = loaded(path);
    const auto size = theirs.GetLargestPossibleRegion().GetSize();
    ASSERT_EQ(got.header.extent,
              (Extent{static_cast<std::int64_t>(size[0]), static_cast<std::int64_t>(size[1]),
                      static_cast<std::int64_t>(size[2])}))
        << path;
    const std::vector<float> ours = values_of(got);
    const float* samples = theirs.GetBufferPointer();
    std::size_t differing = 0;
    // ITK scales in f64 or in f32, so a scaled value may round the other way.
    const double room = got.header.values.identity() ? 0 : 0x1p-23;
    for (std::size_t i = 0; i < std::min(ours.size(), what.samples); ++i)
        differing += !(std::abs(ours[i] - samples[i]) <= room * std::abs(ours[i]));
    EXPECT_EQ(differing, 0u) << path << " of " << ours.size();
    for (unsigned axis = 0; what.geometry && axis < 3; ++axis) {
        // ITK keeps f32 of NIfTI's lengths; MetaIO and NRRD write six digits or more.
        EXPECT_NEAR(got.header.spacing[axis], theirs.GetSpacing()[axis], 1e-6) << path;
        EXPECT_NEAR(got.header.origin[axis], theirs.GetOrigin()[axis], 1e-5) << path;
        for (unsigned row = 0; row < 3; ++row)
            EXPECT_NEAR(got.header.direction[axis][row], theirs.GetDirection()[row][axis], 1e-6)
                << path << " axis " << axis;
    }
}

Volume::Pointer by_itk(const std::string& path, itk::ImageIOBase::Pointer io) {
    auto reader = itk::ImageFileReader<Volume>::New();
    reader->SetImageIO(io);
    reader->SetFileName(path);
    reader->Update();
    return reader->GetOutput();
}

std::string bundled(const std::string& name) {
    const char* folder = std::getenv("EDGEWISE_DATA");
    return folder ? std::string(folder) + "/" + name : "";
}

/// ITK refuses `spacings` beside `space`, so it gets a copy of the header without the latter.
Volume::Pointer head_by_itk(const std::string& folder, const Scratch& scratch) {
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() != ".nhdr")
            std::filesystem::copy_file(entry.path(), scratch.path(entry.path().filename()));
    std::string head = bytes_in(folder + "/quarter.nhdr");
    const auto line = head.find("space: 3D-left-handed\n");
    if (line != head.npos) head.erase(line, head.find('\n', line) + 1 - line);
    return by_itk(scratch.put("quarter.nhdr", head), itk::NrrdImageIO::New().GetPointer());
}

TEST(Itk, AgreesOnTheBundledVolumes) {
    if (bundled("").empty()) GTEST_SKIP() << "EDGEWISE_DATA is not set";
    Scratch scratch;
    expect_equal(bundled("ct_head/quarter.nhdr"), *head_by_itk(bundled("ct_head"), scratch));
    const std::string path = bundled("mr_brain/MR.nii.gz");
    expect_equal(path, *by_itk(path, itk::NiftiImageIO::New().GetPointer()));
}

TEST(Itk, ReadsWhatWeWrite) {
    Scratch scratch;
    Header what;
    what.extent = {5, 4, 3};
    what.type = Type::i16;
    what.spacing = {0.5, 2, 3};
    what.origin = {-10, 20.25, 3};
    what.direction = {Vector{0, 1, 0}, Vector{-1, 0, 0}, Vector{0, 0, 1}};
    what.unit = "mm";
    what.anatomical = true;
    const auto values = ramp(60);
    const std::pair<const char*, itk::ImageIOBase::Pointer> formats[] = {
        {"a.nii", itk::NiftiImageIO::New().GetPointer()},
        {"a.nii.gz", itk::NiftiImageIO::New().GetPointer()},
        {"a.nrrd", itk::NrrdImageIO::New().GetPointer()},
        {"a.mha", itk::MetaImageIO::New().GetPointer()}};
    for (const auto& [name, io] : formats) {
        write(scratch.path(name), what, values.data());
        expect_equal(scratch.path(name), *by_itk(scratch.path(name), io));
    }
    write(scratch.path("a.tif"), what, values.data());
    expect_equal(scratch.path("a.tif"),
                 *by_itk(scratch.path("a.tif"), itk::TIFFImageIO::New().GetPointer()),
                 {.geometry = false});
}

TEST(SharedData, ItkAgreesOnVolumes) {
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    const std::pair<const char*, itk::ImageIOBase::Pointer> files[] = {
        {"ct_tooth_nrrd/tooth.nhdr", itk::NrrdImageIO::New().GetPointer()},
        {"ct_engine_nifti/engine.nii.gz", itk::NiftiImageIO::New().GetPointer()},
        {"mr_angio_nifti/chris_MRA.nii.gz", itk::NiftiImageIO::New().GetPointer()},
        {"mr_aorta_mha/aorta.mha", itk::MetaImageIO::New().GetPointer()},
        {"mr_carotid_vtk/carotid.vtk", itk::VTKImageIO::New().GetPointer()},
        {"mr_brain_nifti/MR.nii.gz", itk::NiftiImageIO::New().GetPointer()},
        {"mr_fetal_nrrd/template_T2.nrrd", itk::NrrdImageIO::New().GetPointer()},
    };
    for (const auto& [name, io] : files) {
        const std::string path = data + "/" + name;
        try {
            expect_equal(path, *by_itk(path, io));
        } catch (const itk::ExceptionObject& failure) {
            ADD_FAILURE() << name << ": ITK: " << failure.GetDescription();
        }
    }
    Scratch scratch;
    expect_equal(data + "/ct_headsq_nrrd/quarter.nhdr",
                 *head_by_itk(data + "/ct_headsq_nrrd", scratch));
    // ITK believes the CompressedDataSize of this header, 2067 bytes short, and stops there without
    // a word (README); we read the stream to its end.
    const std::string frog = data + "/seg_frog_mhd/frogtissue.mhd";
    expect_equal(frog, *by_itk(frog, itk::MetaImageIO::New().GetPointer()), {.samples = 30963285});
    const std::string neuron = data + "/mic_neuron_tiff/neuron.tif";
    expect_equal(neuron, *by_itk(neuron, itk::TIFFImageIO::New().GetPointer()),
                 {.geometry = false});
}

TEST(SharedData, ItkAgreesOnTheDicomSeries) {
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    const std::string folder = data + "/ct_chest_dicom";
    auto names = itk::GDCMSeriesFileNames::New();
    names->SetDirectory(folder);
    auto reader = itk::ImageSeriesReader<Volume>::New();
    reader->SetImageIO(itk::GDCMImageIO::New());
    reader->SetFileNames(names->GetInputFileNames());
    reader->Update();
    expect_equal(folder, *reader->GetOutput());
}

TEST(SharedData, ItkAgreesOnPhotographs) {
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    const auto compare = [&](const char* name, itk::ImageIOBase::Pointer io) {
        const std::string path = data + "/img_2d/" + name;
        const Loaded got = loaded(path);
        io->SetFileName(path);
        io->ReadImageInformation();
        ASSERT_EQ(io->GetNumberOfComponents(), static_cast<unsigned>(got.header.channels));
        itk::ImageIORegion region(2);
        for (unsigned axis = 0; axis < 2; ++axis) region.SetSize(axis, io->GetDimensions(axis));
        io->SetIORegion(region);
        ASSERT_EQ(static_cast<std::size_t>(io->GetImageSizeInBytes()), got.samples.bytes());
        std::vector<std::byte> theirs(got.samples.bytes());
        io->Read(theirs.data());
        EXPECT_EQ(std::memcmp(theirs.data(), got.samples.data(), theirs.size()), 0) << path;
    };
    compare("hdr_room.png", itk::PNGImageIO::New().GetPointer());
    compare("coffee.png", itk::PNGImageIO::New().GetPointer());
    compare("DFM_4209.jpg", itk::JPEGImageIO::New().GetPointer());
}

}  // namespace
}  // namespace edgewise::store
