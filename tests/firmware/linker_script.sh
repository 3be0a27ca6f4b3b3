#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# What is not allowed in an image does not link, and the linker reports the reason.
# usage: linker_script.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
boards=$1/firmware/boards build=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

flags=(-mcpu=cortex-m3 -mthumb -std=c++20 -Os -ffreestanding -fno-rtti -fno-threadsafe-statics -ffunction-sections -fdata-sections)
lean=(-fno-exceptions -fno-unwind-tables -fno-asynchronous-unwind-tables)
libraries=("$build/firmware/boards/mps2_an385/libcbcan_mps2.a" "$build/firmware/boards/libcbcan_cortex_m.a" "$build"/firmware/libcbcan_*.a)
ran=0 failed=false

# image NAME SAID CODE FLAG...: CODE does not link, and the linker prints SAID; with an empty SAID it links.
image() {
  local name=$1 said=$2 output code=0
  printf '%s\n' "$3" >"$scratch/image.cpp"
  output=$(arm-none-eabi-g++ "${flags[@]}" "${@:4}" -nostdlib -T "$boards/mps2_an385/mps2_an385.ld" -L "$boards/common" \
    -Wl,--gc-sections,--fatal-warnings "$scratch/image.cpp" -Wl,--start-group "${libraries[@]}" -Wl,--end-group -lc_nano -lgcc \
    -o "$scratch/image.elf" 2>&1) || code=$?
  ((++ran))
  if [[ $said ]] && { ((code == 0)) || ! grep -qE "$said" <<<"$output"; } || [[ ! $said ]] && ((code != 0)); then
    echo "$name: exit code $code; it should have been: ${said:-an image}; but: $output" >&2
    failed=true
  fi
}

image "nothing" '' 'int main() { for (;;) {} }' "${lean[@]}"
image "malloc" 'heap: something allocates' '#include <stdlib.h>
void* volatile block; int main() { block = malloc(4); return 0; }' "${lean[@]}"
image "new" 'operator new' 'int* volatile block; int main() { block = new int[3]; return 0; }' "${lean[@]}"
image "a virtual destructor" 'operator delete' 'struct Base { virtual ~Base() = default; virtual int value() = 0; };
struct Derived : Base { int value() override { return 1; } };
Derived* volatile object; int main() { Derived here; object = &here; return object->value(); }' "${lean[@]}"
image "a static object with a destructor" 'atexit: ' 'volatile int gone; struct Object { ~Object() { gone = 1; } } object;
int main() { return 0; }' "${lean[@]}"
image "printf" 'stdio: ' '#include <stdio.h>
int main() { printf("%d", 3); return 0; }' "${lean[@]}"
image "throw" 'unwinder: ' 'int main() { throw 1; }'
image "a division of times" '64-bit division: ' 'volatile unsigned long long time; int main() { return time / 1000; }' "${lean[@]}"
image "more RAM than there is" 'region .RAM. overflowed' 'volatile char bytes[11300]; int main() { bytes[1] = 1; return 0; }' "${lean[@]}"
image "more flash than there is" 'region .FLASH. overflowed' 'extern const char bytes[32100]; const char bytes[32100] = {1};
int main(int count, char**) { return bytes[count]; }' "${lean[@]}"

echo "$ran cases ran"
if $failed; then exit 1; fi
