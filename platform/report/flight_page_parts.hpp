/// The sources of the page (folder page), as CMake puts them into the program.
#pragma once

namespace roborun::report {

extern const char* const kFlightPageHtml;
extern const char* const kFlightPageStyle;
extern const char* const kFlightPageScript;

}  // namespace roborun::report
