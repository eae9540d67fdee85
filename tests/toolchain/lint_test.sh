#!/usr/bin/env bash
# The house checks refuse what they are for, and let a clean tree pass.
set -u
root=$(cd "$(dirname "$0")/../.." && pwd)
tree=$(mktemp -d) || exit 1
trap 'rm -rf "$tree"' EXIT
failed=0
fresh() {
  rm -rf "${tree:?}"/*
  mkdir -p "$tree"/{firmware_if,core,governor,stages,platform/app}
  echo '#pragma once' >"$tree/core/clean.hpp"
}
expect() {
  local wanted=$1 check=$2 why=$3
  ROBORUN_ROOT=$tree "$root/toolchain/lint/$check" >/dev/null 2>&1
  local code=$?
  if [[ ($wanted == passes && $code -ne 0) || ($wanted == refuses && $code -eq 0) ]]; then
    echo "FAILED $check: $why: exit code $code"
    failed=1
  fi
}
fresh; for check in layers words complexity; do expect passes $check "a clean tree"; done
fresh; echo '#include "stages/x.hpp"' >"$tree/core/bad.hpp"; expect refuses layers "core includes stages"
fresh; echo '#include "stages/x.hpp"' >"$tree/governor/bad.hpp"; expect refuses layers "governor includes stages"
fresh; echo '#include "governor/x.hpp"' >"$tree/stages/bad.hpp"; expect refuses layers "stages include governor"
fresh; echo '#include "core/x.hpp"' >"$tree/firmware_if/bad.hpp"; expect refuses layers "firmware_if includes core"
fresh; echo '#include <unistd.h>' >"$tree/core/bad.hpp"; expect refuses layers "an OS header in core"
fresh; mkdir -p "$tree/platform/flight/example"; echo '#include "platform/board/x.hpp"' >"$tree/platform/flight/example/good.hpp"
expect passes layers "an example includes the simulator"
echo '#include "platform/board/x.hpp"' >"$tree/platform/flight/bad.hpp"; expect refuses layers "the runtime includes a board"
fresh; mkdir "$tree/extra"; expect refuses layers "another top-level folder"
fresh; rm "$tree/core/clean.hpp"; expect refuses layers "nothing to check"; expect refuses words "nothing to check"
fresh; rm "$tree/core/clean.hpp"; expect refuses complexity "nothing to check"
for line in 'int* p = new int;' 'void* p = malloc(4);' 'std::vector<int> v;' 'throw 1;' 'std::mutex m;' 'auto t = steady_clock::now();' \
  'double y = std::sin(x);' '#include <vector>'; do
  fresh; echo "$line" >"$tree/core/bad.cpp"; expect refuses words "$line"
done
fresh; echo '// a new thread may throw' >"$tree/core/comment.cpp"; expect passes words "words in a comment"

# page TEXT...: README.md with these lines; other.md has two headings of one name and an id.
page() {
  fresh
  printf '%s\n' '# Other: a `page`' '## Twice' '## Twice' '<a id="here"></a>' >"$tree/other.md"
  printf '%s\n' '# First' '[all](other.md)' "$@" >"$tree/README.md"
}
for line in '[a](other.md#other-a-page)' '[a](other.md#twice-1)' '[a](other.md#here)' '[a](#first)' '[folder](core) [file](core/clean.hpp)' '![p](other.md "title")' \
  '[far](https://example.org/none) <mailto:a@b>' '`[code](none.md)`' '[r]: other.md'; do
  page "$line"; expect passes links "$line"
done
for line in '[a](none.md)' '[a](Other.md)' '[a](other.md#none)' '[a](other.md#twice-2)' '[a](#none)' '[a](../outside.md)' '[a](/other.md)' '[a](core/clean.hpp#x)' \
  '![p](none.svg)' '[![p](none.svg)](other.md)' '[![p](other.md)](none.md)' '[r]: none.md' '<img src="none.svg">' '- a [b](none.md) c'; do
  page "$line"; expect refuses links "$line"
done
page '[a' 'b](none.md)'; expect refuses links "a link over two lines"
page '[a](' 'none.md)'; expect refuses links "a target in the next line"
page '`code' '[a](none.md)`'; expect passes links "a link in code over two lines"
page 'a ` alone' '' '[a](none.md) `'; expect refuses links "a link between marks of two paragraphs"
page '| ` |' '| [a](none.md) ` |'; expect refuses links "a link between marks of two rows"
page '```' '[a](none.md)' '```'; expect passes links "a link in fenced code"
page '```' '```' '[a](none.md)'; expect refuses links "a link behind fenced code"
page '```' '# Fenced' '```' '[a](#fenced)'; expect refuses links "a heading in fenced code"
page; echo '# Alone' >"$tree/core/alone.md"; expect refuses links "a page that no link leads to"
page; mkdir -p "$tree/build"; echo '[a](none.md)' >"$tree/build/README.md"; expect passes links "a page of a build"
fresh; expect refuses links "nothing to check"

if command -v codespell >/dev/null; then
  page 'Two rows per decision, 5 ms per scan.'; expect passes prose "a clean page"
  for line in 'Two rows a decision.' 'It takes 5 ms a scan.' 'It is blazingly fast.' 'This is obviously so.' 'We utilise it.' 'TODO: more' 'It recieves.'; do
    page "$line"; expect refuses prose "$line"
  done
  page '`once a second` in code'; expect passes prose "code in a page"
  page; echo 'auto x = "once a second";' >"$tree/platform/app/bad.cpp"
  expect refuses prose "a help text"
  page; for ((i = 0; i < 130; ++i)); do echo; done >>"$tree/README.md"; expect refuses prose "a README of 130 lines"
  fresh; expect refuses prose "nothing to check"
fi

# lines COUNT TEXT: the text, so many times.
lines() { for ((i = 0; i < $1; ++i)); do printf '%s\n' "$2"; done; }
for folder in firmware_if core governor stages platform/flight; do
  fresh; mkdir -p "$tree/$folder"; lines 501 '// long' >"$tree/$folder/bad.cpp"; expect refuses complexity "501 lines in $folder"
done
fresh; lines 500 '// long' >"$tree/core/fine.cpp"; expect passes complexity "500 lines"
fresh; mkdir "$tree/platform/can"; lines 501 '// long' >"$tree/platform/can/fine.cpp"; expect passes complexity "a long file of a tool"
# function BODY: a member function of a template, its body behind what a parser can trip over.
function_of() {
  printf '%s\n' '#if 1' '#define BRACE {' '#endif' 'namespace a::b { template <typename T> struct S {' "  char c{'{'};" \
    '  S(int x) noexcept : y_{x}, z_(x) {}' '  const char* text = R"(if { && )"; int big = 1'"'"'000'"'"'000;' \
    '  auto bad(T&& t) const -> decltype(t) {' "$1" '  }' '  int y_, z_;' '}; }'
}
fresh; function_of "$(lines 58 '    x();')" >"$tree/core/fine.cpp"; expect passes complexity "a function of 60 lines"
fresh; function_of "$(lines 59 '    x();')" >"$tree/core/bad.cpp"; expect refuses complexity "a function of 61 lines"
for branch in 'if (x) y();' 'for (;;) y();' 'while (x) y();' 'a = x && y;' 'a = x || y;' 'a = x ? y : z;' 'catch (X) {}' 'case 1:' 'f([] { if (x) y(); });'; do
  fresh; function_of "$(lines 19 "    $branch")" >"$tree/core/fine.cpp"; expect passes complexity "20: $branch"
  fresh; function_of "$(lines 20 "    $branch")" >"$tree/core/bad.cpp"; expect refuses complexity "21: $branch"
done
fresh; function_of "$(lines 30 '    auto&& x = y; // if while && ?' | sed 's/$/ f("if (x) ? &&");/')" >"$tree/core/fine.cpp"; expect passes complexity "branches in comments and text"
fresh; echo 'void f() {' >"$tree/core/bad.cpp"; expect refuses complexity "a brace that is never closed"

if command -v c++ >/dev/null; then
  echo '#include <cstdlib>
  void* grab(unsigned long n) { return std::malloc(n); }' | c++ -x c++ -c -o "$tree/bad.o" - && ar rc "$tree/bad.a" "$tree/bad.o"
  echo 'int two() { return 2; }' | c++ -x c++ -c -o "$tree/good.o" - && ar rc "$tree/good.a" "$tree/good.o"
  "$root/toolchain/lint/symbols" "$tree/bad.a" >/dev/null 2>&1 && { echo "FAILED symbols: an archive that calls malloc passes"; failed=1; }
  "$root/toolchain/lint/symbols" "$tree/good.a" >/dev/null 2>&1 || { echo "FAILED symbols: a clean archive is refused"; failed=1; }
  echo 'int main() {}' | c++ -x c++ -no-pie -Wl,-z,execstack -o "$tree/soft" -
  "$root/toolchain/lint/hardening" "$tree/soft" >/dev/null 2>&1 && { echo "FAILED hardening: a soft program passes"; failed=1; }
fi
[[ $failed -eq 0 ]] && echo "the checks refuse what they are for"
exit $failed
