# SPDX-License-Identifier: Apache-2.0
# The Debian 12 packages Dapple needs. Sourced by the other scripts; `bash scripts/packages.sh` prints the lists.

build_packages=(
  g++ cmake ninja-build ccache
  libimath-dev        # vectors and matrices
  libopenimageio-dev openimageio-tools  # images and textures; the CMake file of the first demands the second
  libosd-dev          # subdivision surfaces
  libembree-dev       # ray tracing
  libtbb-dev          # threads
  libdnnl-dev         # convolutions of the denoiser
  libeigen3-dev       # dense solvers
  libspdlog-dev       # messages
  nlohmann-json3-dev  # statistics, extensions of glTF
  libcli11-dev        # command line
  libassimp-dev       # models of other programs
  libepoxy-dev libegl-dev libgl1-mesa-dri  # --device gl: OpenGL without a window; the last has a device by software
  zlib1g-dev          # .pbrt.gz, .ply.gz, packed volumes
  libblosc-dev        # packed volumes
)
python_packages=(python3-dev python3-numpy python3-pybind11 pybind11-dev)  # import dapple.canopy; left out where they are absent
test_packages=(libgtest-dev librapidcheck-dev)
bench_packages=(python3 python3-numpy python3-openimageio libbenchmark-dev valgrind)
fuzz_packages=(clang libclang-rt-14-dev)
format_packages=(clang-format)
model_packages=(assimp-testmodels)  # models that scripts/models renders
peer_packages=(blender povray)  # other renderers that bench/ compares with

# install_packages PACKAGE...: installs those that are missing. Needs root or sudo only when some are.
install_packages() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then return 0; fi

  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "Missing Debian packages: ${missing[*]}" >&2
      echo "You are not root and there is no sudo. Ask an administrator to run: apt-get install ${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
  fi
  if ! command -v apt-get >/dev/null; then
    echo "Missing packages (by their names on Debian 12): ${missing[*]}" >&2
    echo "There is no apt-get here: install them in this system's own way." >&2
    return 1
  fi
  echo "Installing Debian packages: ${missing[*]}"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
}

if [ "${BASH_SOURCE[0]}" = "$0" ]; then
  for list in build python test bench fuzz format model peer; do
    declare -n packages="${list}_packages"
    echo "$list: ${packages[*]}"
  done
fi
