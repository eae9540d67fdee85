/// The sources of the pages (folder page), as CMake puts them into the program.
#pragma once

namespace roborun::report {

extern const char* const kPageStyle;  ///< Colours (light, dark, print), letters and tables of all pages.
extern const char* const kFlightPageHtml;
extern const char* const kFlightPageStyle;  ///< What it has besides.
extern const char* const kFlightPageScript;

}  // namespace roborun::report
