// The module that reads by ITK: GIPL.

#include <cstdio>
#include <exception>
#include <itkGiplImageIO.h>
#include <itkObject.h>
#include <new>
#include <string>

#include "io/module.hpp"

namespace {

using edgewise::Type;
using edgewise::store::kModuleError;
using edgewise::store::ModuleImage;

void tell(char* error, const std::string& what) {
    std::snprintf(error, kModuleError, "%s", what.c_str());
}

itk::ImageIOBase::Pointer reader_of(const std::string& path) {
    itk::Object::SetGlobalWarningDisplay(false);
    itk::ImageIOBase::Pointer io(itk::GiplImageIO::New());
    io->SetFileName(path);
    io->ReadImageInformation();
    return io;
}

bool type_of(const itk::ImageIOBase& io, int& type) {
    switch (io.GetComponentType()) {
        case itk::IOComponentEnum::UCHAR:
            type = static_cast<int>(Type::u8);
            return true;
        case itk::IOComponentEnum::CHAR:
            type = static_cast<int>(Type::i8);
            return true;
        case itk::IOComponentEnum::USHORT:
            type = static_cast<int>(Type::u16);
            return true;
        case itk::IOComponentEnum::SHORT:
            type = static_cast<int>(Type::i16);
            return true;
        case itk::IOComponentEnum::UINT:
            type = static_cast<int>(Type::u32);
            return true;
        case itk::IOComponentEnum::INT:
            type = static_cast<int>(Type::i32);
            return true;
        case itk::IOComponentEnum::FLOAT:
            type = static_cast<int>(Type::f32);
            return true;
        case itk::IOComponentEnum::DOUBLE:
            type = static_cast<int>(Type::f64);
            return true;
        default:
            return false;
    }
}

bool inspect(const char* path, ModuleImage* found, char* error) {
    const auto io = reader_of(path);
    const unsigned axes = io->GetNumberOfDimensions();
    if (axes < 2 || axes > 3 || !type_of(*io, found->type)) {
        tell(error, "samples of this type or number of axes are not supported");
        return false;
    }
    found->axes = static_cast<int>(axes);
    found->channels = static_cast<int>(io->GetNumberOfComponents());
    for (unsigned axis = 0; axis < axes; ++axis) {
        found->size[axis] = static_cast<std::int64_t>(io->GetDimensions(axis));
        found->spacing[axis] = io->GetSpacing(axis);
        found->origin[axis] = io->GetOrigin(axis);
        const auto direction = io->GetDirection(axis);
        for (unsigned row = 0; row < axes; ++row) found->direction[3 * axis + row] = direction[row];
    }
    std::snprintf(found->format, sizeof found->format, "%s", "GIPL");
    return true;
}

bool read(const char* path, const ModuleImage* image, void* into, std::size_t bytes, char* error) {
    const auto io = reader_of(path);
    int type = 0;
    if (!type_of(*io, type) || type != image->type ||
        static_cast<std::size_t>(io->GetImageSizeInBytes()) != bytes) {
        tell(error, "its size is not what its header said");
        return false;
    }
    itk::ImageIORegion region(io->GetNumberOfDimensions());
    for (unsigned axis = 0; axis < io->GetNumberOfDimensions(); ++axis)
        region.SetSize(axis, io->GetDimensions(axis));
    io->SetIORegion(region);
    io->Read(into);
    return true;
}

/// Exceptions must not cross into a program that was built without this library.
template <class F>
bool guarded(char* error, F call) noexcept {
    try {
        return call();
    } catch (const itk::ExceptionObject& failure) {
        tell(error, failure.GetDescription());
    } catch (const std::bad_alloc&) {
        tell(error, "out of memory");
    } catch (const std::exception& failure) {
        tell(error, failure.what());
    } catch (...) {
        tell(error, "unknown error");
    }
    return false;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) bool edgewise_inspect(const char* path,
                                                                        ModuleImage* found,
                                                                        char* error) {
    return guarded(error, [&] { return inspect(path, found, error); });
}
extern "C" __attribute__((visibility("default"))) bool edgewise_read(const char* path,
                                                                     const ModuleImage* image,
                                                                     void* into, std::size_t bytes,
                                                                     char* error) {
    return guarded(error, [&] { return read(path, image, into, bytes, error); });
}
