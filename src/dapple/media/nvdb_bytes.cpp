// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/nvdb_bytes.h"

#include <blosc.h>
#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

namespace dapple::media {
namespace {

// NanoVDB packs with zlib all at once and with blosc by pieces of this size; before each stands its packed size.
constexpr uint64_t blosc_piece = uint64_t(1) << 30;

[[noreturn]] void damaged(const char* codec, const std::string& what) {
  throw std::runtime_error(std::string("has ") + codec + " data that " + what);
}

/// The next packed piece; moves `rest` on.
std::string_view next_piece(std::string_view* rest, const char* codec) {
  uint64_t size = 0;
  if (rest->size() < sizeof size) damaged(codec, "end too early");
  std::memcpy(&size, rest->data(), sizeof size);
  rest->remove_prefix(sizeof size);
  if (size > rest->size())
    damaged(codec, "should take " + std::to_string(size) + " bytes; " + std::to_string(rest->size()) + " are left");
  const std::string_view piece = rest->substr(0, size);
  rest->remove_prefix(size);
  return piece;
}

void unpack_zip(std::string_view packed, Pages* out, bool mapped) {
  std::string_view piece = next_piece(&packed, "zip");
  z_stream z{};
  if (inflateInit(&z) != Z_OK) throw std::bad_alloc();
  struct End {
    z_stream* z;
    ~End() { inflateEnd(z); }
  } const end{&z};
  constexpr size_t step = size_t(1) << 22;
  size_t done = 0;
  const size_t size = out->view().size();
  int status = Z_OK;
  while (status == Z_OK) {
    const auto in = uInt(std::min(piece.size(), step)), room = uInt(std::min(size - done, step));
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(piece.data())), z.avail_in = in;
    z.next_out = reinterpret_cast<Bytef*>(out->data() + done), z.avail_out = room;
    status = inflate(&z, Z_NO_FLUSH);
    if (mapped) Pages::release(piece.substr(0, in - z.avail_in));
    piece.remove_prefix(in - z.avail_in), done += room - z.avail_out;
  }
  if (status != Z_STREAM_END || done != size) damaged("zip", "are damaged, or not as long as they say");
}

void unpack_blosc(std::string_view packed, Pages* out, bool mapped) {
  for (uint64_t done = 0, size = out->view().size(); done < size;) {
    const std::string_view piece = next_piece(&packed, "blosc");
    const uint64_t wanted = std::min(size - done, blosc_piece);
    size_t length = 0;
    // The last argument is the count of threads.
    if (blosc_cbuffer_validate(piece.data(), piece.size(), &length) != 0 || length != wanted ||
        blosc_decompress_ctx(piece.data(), out->data() + done, wanted, 1) != int(wanted))
      damaged("blosc", "are damaged, or not as long as they say");
    if (mapped) Pages::release(piece);
    done += wanted;
  }
}

}  // namespace

Pages::Pages(size_t size) : data_(nullptr), size_(size) {
  if (size == 0) return;
  data_ = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (data_ == MAP_FAILED) throw std::bad_alloc();
}

Pages::~Pages() {
  if (data_) munmap(data_, size_);
}

void Pages::release(std::string_view range) {
  const auto page = uintptr_t(sysconf(_SC_PAGESIZE));
  const uintptr_t first = (reinterpret_cast<uintptr_t>(range.data()) + page - 1) / page * page;
  const uintptr_t end = reinterpret_cast<uintptr_t>(range.data() + range.size()) / page * page;
  if (first < end) madvise(reinterpret_cast<void*>(first), end - first, MADV_DONTNEED);
}

Pages unpack(std::string_view packed, NvdbCodec codec, uint64_t size, bool mapped) {
  if (size > (uint64_t(16) << 20) + 128 * uint64_t(packed.size()))
    throw std::runtime_error("unpacks to an implausible size of " + std::to_string(size) + " bytes");
  Pages out(size);
  if (codec == NvdbCodec::zip)
    unpack_zip(packed, &out, mapped);
  else
    unpack_blosc(packed, &out, mapped);
  return out;
}

}  // namespace dapple::media
