cmake_minimum_required(VERSION 3.25)
# cmake -DSOURCE=TREE -DOUT=FILE -P write_commit.cmake: the commit of TREE as a C++ source, written only where it has changed.
# "+changes": tracked files differ from that commit. "unknown": no git, or TREE is not in it.
set(commit "unknown")
set(date "unknown")
execute_process(COMMAND git -C ${SOURCE} ls-files --error-unmatch CMakeLists.txt RESULT_VARIABLE untracked OUTPUT_QUIET ERROR_QUIET)
if(untracked EQUAL 0)
  execute_process(COMMAND git -C ${SOURCE} rev-parse HEAD OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE)
  execute_process(COMMAND git -C ${SOURCE} log -1 --format=%cs OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE)
  execute_process(COMMAND git -C ${SOURCE} --no-optional-locks status --porcelain --untracked-files=no . OUTPUT_VARIABLE changes)
  if(changes)
    string(APPEND commit "+changes")
  endif()
endif()
file(CONFIGURE OUTPUT ${OUT} @ONLY CONTENT
"// Written by toolchain/cmake/write_commit.cmake at every build.
namespace roborun::report {
extern const char* const kCommit;
const char* const kCommit = \"${commit}\";
extern const char* const kCommitDate;
const char* const kCommitDate = \"${date}\";
}  // namespace roborun::report
")
