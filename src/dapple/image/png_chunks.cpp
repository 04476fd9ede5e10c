// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/png_chunks.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>

namespace dapple::image {

void check_png_chunks(const std::string& path, uint64_t file_size, const FileLoc& loc) {
  constexpr uint64_t signature = 8, head_size = 8, check_size = 4;
  std::ifstream in(path, std::ios::binary);
  std::array<unsigned char, head_size> head;
  for (uint64_t at = signature; at + head_size <= file_size;) {
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return;  // the reader proper will say why
    const uint64_t length = uint64_t(head[0]) << 24 | uint64_t(head[1]) << 16 | uint64_t(head[2]) << 8 | head[3];
    std::string type(head.begin() + 4, head.end());
    if (type == "IEND") return;
    if (length > file_size - at - head_size) {
      std::replace_if(
          type.begin(), type.end(), [](unsigned char c) { return !std::isalnum(c); }, '?');
      throw InputError(loc, "image \"" + path + "\" is damaged: its chunk " + type + " at byte " + std::to_string(at) +
                                " claims " + std::to_string(length) + " bytes, more than the file has");
    }
    at += head_size + length + check_size;
  }
}

}  // namespace dapple::image
