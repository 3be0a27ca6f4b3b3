# SPDX-License-Identifier: MIT
# Sourced by tools/demo, tools/test and tools/dev: the Debian packages that they need, and their installation.

# To build and run the simulator.
build_packages=(g++ cmake ninja-build pkg-config libfmt-dev libtomlplusplus-dev
  libmicrohttpd-dev libmodbus-dev nlohmann-json3-dev liblua5.4-dev python3)

# In addition, to build and run the image for a microcontroller.
mcu_packages=(gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-dev qemu-system-arm socat)

# In addition, for the tests: their libraries and clients, and the guest whose kernel has CAN.
test_packages=(catch2 cloc librapidcheck-dev valgrind git
  clang-14 libclang-rt-14-dev gcovr
  "${mcu_packages[@]}" g++-riscv64-linux-gnu g++-s390x-linux-gnu qemu-user
  chromium fonts-dejavu-core
  python3-pymodbus python3-serial-asyncio python3-can mbpoll can-utils iproute2 tshark curl
  qemu-system-x86 busybox-static
  dpkg-dev file lintian man-db mmdebstrap mypy parallel pngquant python3-pip python3-pytest python3-yaml shellcheck systemd yamllint)

# Only for --long: their packages start services.
long_packages=(munge openssh-server rsync slurm-wlm)

# To build the WebAssembly module.
module_packages=("${build_packages[@]}" clang-19 lld-19 llvm-19 wasi-libc libc++-19-dev-wasm32 libc++abi-19-dev-wasm32
  libclang-rt-19-dev-wasm32 binaryen libfast-float-dev dpkg-dev)

# To build the Python wheel.
wheel_packages=("${build_packages[@]}" autoconf automake dpkg-dev libtool make)

is_installed() { [[ $(dpkg-query --show --showformat='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]; }

# apt_get ARGUMENT...: as root, and after another apt or dpkg that is at work: for ten minutes at most.
apt_get() {
  local run=() said tries=0
  ((EUID == 0)) || run=(sudo)
  until said=$(DEBIAN_FRONTEND=noninteractive "${run[@]}" apt-get -qq -o DPkg::Lock::Timeout=600 "$@" 2>&1); do
    if [[ $said != *"Could not get lock"* ]] || ((++tries > 300)); then
      echo "$said" >&2
      return 1
    fi
    ((tries > 1)) || echo "waiting for another apt to end"
    sleep 2
  done
}

# install_packages PACKAGE...: those that are missing, by apt; says what it does.
install_packages() {
  local missing=() package
  # Chromium and Node.js are often there from elsewhere.
  for package in "$@"; do
    is_installed "$package" || [[ $package == chromium && -x /usr/bin/chromium ]] || missing+=("$package")
  done
  [[ " $* " == *" mbpoll "* ]] && ! command -v npm >/dev/null && missing+=(nodejs npm)
  ((${#missing[@]} == 0)) && return
  if ! command -v apt-get >/dev/null; then
    echo "this script installs Debian packages; here is no apt-get. What is needed: ${missing[*]}" >&2
    exit 3
  fi
  echo "installing with apt: ${missing[*]}"
  apt_get update
  apt_get install -y --no-install-recommends "${missing[@]}"
}

# debian_source PACKAGE FOLDER: unpacks the source package there, and again once the installed packages of it are newer.
debian_source() {
  local work list apt installed unpacked
  installed=$(dpkg-query --show --showformat='${source:Package} ${source:Version}\n' | sed -n "s/^$1 //p" | sort --version-sort | tail -n 1)
  if [[ -d $2/debian ]]; then
    unpacked=$(dpkg-parsechangelog --file "$2/debian/changelog" --show-field Version)
    dpkg --compare-versions "$unpacked" ge "$installed" && return
    rm -r "$2"
  fi
  work=$(mktemp -d)
  mkdir -p "$work/parts" "$work/lists/partial" "$2"
  # This machine's own places, as places of source packages.
  for list in /etc/apt/sources.list.d/*.sources; do
    [[ -e $list ]] && sed 's/^Types:.*/Types: deb-src/' "$list" >"$work/parts/$(basename "$list")"
  done
  { cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list 2>/dev/null || true; } | sed -n "s/^deb /deb-src /p" >"$work/parts/all.list"
  apt=(apt-get -qq -o APT::Sandbox::User=root -o Dir::Etc::SourceList=- -o "Dir::Etc::SourceParts=$work/parts"
    -o "Dir::State::Lists=$work/lists")
  "${apt[@]}" update
  (cd "$work" && "${apt[@]}" source --download-only "$1" && dpkg-source --no-check -x ./"$1"_*.dsc source >/dev/null)
  cp -a "$work/source/." "$2"  # with its times: what is newer is made again
  rm -r "$work"
}
