#pragma once

namespace edgewise::charts {

// The files of the pages, as CMake found them: page/*, d3 and its licence.
extern const char* const kPageHtml;
extern const char* const kPageCss;
extern const char* const kPageScript;
extern const char* const kReportHtml;
extern const char* const kReportCss;
extern const char* const kD3;
extern const char* const kD3Licence;

}  // namespace edgewise::charts
