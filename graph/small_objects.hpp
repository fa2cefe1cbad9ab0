#pragma once

#include <memory_resource>

namespace edgewise {

/// Where small objects come from that stand around samples and come and go with every run. What is
/// given back is used again: a run that does what one before it did asks the system for nothing.
/// Threads share it. It counts no bytes, and lives as long as the process, as results may outlive
/// all else.
std::pmr::memory_resource* small_objects();

}  // namespace edgewise
