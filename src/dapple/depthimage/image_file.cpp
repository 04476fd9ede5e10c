// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/image_file.h"

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "dapple/base/error.h"
#include "dapple/base/input_file.h"
#include "dapple/image/atomic_file.h"

namespace dapple::depthimage {

namespace {

static_assert(std::endian::native == std::endian::little, "images are written as they lie in memory");

constexpr char magic[16] = "dapple-trees";
constexpr uint32_t version = 1;
constexpr uint32_t longest_name = 4096;
constexpr size_t largest_file = size_t(8) << 30;

class Writer {
 public:
  template <class T>
  void put(const T& value) {
    put_all(&value, 1);
  }
  template <class T>
  void put_all(const T* values, size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* from = reinterpret_cast<const std::byte*>(values);
    bytes.insert(bytes.end(), from, from + count * sizeof(T));
  }
  void put_vector(const V3f& v) {
    for (int k = 0; k < 3; ++k) put(v[k]);
  }
  void put_count(size_t n) { put(uint32_t(n)); }
  std::vector<std::byte> bytes;
};

class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(FileLoc{name_, 0, 0}, "byte " + std::to_string(at_) + ": " + what);
  }
  void expect(bool holds, const char* what) const {
    if (!holds) fail(what);
  }
  template <class T>
  T get(const char* what) {
    T value;
    get_all(&value, 1, what);
    return value;
  }
  template <class T>
  void get_all(T* to, size_t count, const char* what) {
    static_assert(std::is_trivially_copyable_v<T>);
    expect_room(count * sizeof(T), what);
    if (count > 0) std::memcpy(to, bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  template <class T>
  std::vector<T> get_vector(size_t count, const char* what) {
    expect_room(count * sizeof(T), what);
    std::vector<T> out(count);
    get_all(out.data(), count, what);
    return out;
  }
  uint32_t get_count(uint32_t least, uint32_t most, const char* what) {
    const auto n = get<uint32_t>(what);
    if (n < least || n > most)
      fail(std::string(what) + " are " + std::to_string(n) + ", expected " + std::to_string(least) + " to " +
           std::to_string(most));
    return n;
  }
  float get_float(float least, float most, const char* what) {
    const float v = get<float>(what);
    if (!(v >= least && v <= most)) fail(std::string(what) + ": a number out of range");
    return v;
  }
  V3f get_point(const char* what) {
    V3f p;
    for (int k = 0; k < 3; ++k) p[k] = get_float(-1e18f, 1e18f, what);
    return p;
  }
  RGB get_share(const char* what) {
    RGB c;
    for (int k = 0; k < 3; ++k) c[k] = get_float(0, 1, what);
    return c;
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  void expect_room(size_t size, const char* what) const {
    if (size > bytes_.size() - at_) fail(std::string("the file ends within ") + what);
  }
  const std::span<const std::byte> bytes_;
  const std::string& name_;
  size_t at_ = 0;
};

void put_object(const ObjectImages& o, Writer* w) {
  w->put(o.key);
  const size_t length = std::min<size_t>(o.name.size(), longest_name);
  w->put_count(length);
  w->put_all(o.name.data(), length);
  w->put_vector(o.centre);
  w->put(o.radius);
  w->put_vector(o.box.min);
  w->put_vector(o.box.max);
  w->put_count(size_t(o.layers));
  w->put_count(o.directions.size());
  for (const V3f& d : o.directions) w->put_vector(d);
  w->put_count(o.materials.size());
  for (const ImageMaterial& m : o.materials)
    for (const RGB& c : {m.reflectance, m.transmittance})
      for (int k = 0; k < 3; ++k) w->put(c[k]);
  w->put_count(o.levels.size());
  for (const ImageLevel& level : o.levels) {
    w->put_count(size_t(level.resolution));
    for (const LayeredImage& image : level.views) {
      w->put_count(image.fragments.size());
      w->put_all(image.first.data(), image.first.size());
      w->put_all(image.fragments.data(), image.fragments.size());
    }
  }
}

LayeredImage get_image(uint32_t resolution, size_t materials, Reader* r) {
  LayeredImage image;
  const auto count = r->get<uint32_t>("the number of fragments");
  image.first = r->get_vector<uint32_t>(size_t(resolution) * resolution + 1, "the table of texels");
  r->expect(image.first.front() == 0 && image.first.back() == count, "the table of texels does not hold all fragments");
  for (size_t t = 1; t < image.first.size(); ++t)
    r->expect(image.first[t - 1] <= image.first[t], "the table of texels goes backwards");
  image.fragments = r->get_vector<Fragment>(count, "fragments");
  for (const Fragment& f : image.fragments)
    r->expect(f.mask != 0 && f.material < materials, "a fragment without samples, or of a material that is not there");
  for (size_t t = 1; t < image.first.size(); ++t)
    for (uint32_t f = image.first[t - 1] + 1; f < image.first[t]; ++f)
      r->expect(image.fragments[f - 1].depth <= image.fragments[f].depth, "fragments of a texel go back to front");
  return image;
}

ObjectImages get_object(Reader* r) {
  ObjectImages o;
  o.key = r->get<uint64_t>("the key");
  o.name.resize(r->get_count(0, longest_name, "characters of the name"));
  r->get_all(o.name.data(), o.name.size(), "the name");
  o.centre = r->get_point("the centre");
  o.radius = r->get_float(1e-12f, 1e18f, "the radius");
  o.box.min = r->get_point("the box");
  o.box.max = r->get_point("the box");
  for (int k = 0; k < 3; ++k) r->expect(o.box.min[k] <= o.box.max[k], "the box is empty");
  o.layers = int(r->get_count(0, ObjectImages::most_layers, "layers"));
  const uint32_t directions = r->get_count(1, ObjectImages::most_views, "directions");
  for (uint32_t d = 0; d < directions; ++d) {
    o.directions.push_back(r->get_point("a direction"));
    r->expect(std::abs(length(o.directions.back()) - 1) < 1e-4f, "a direction is not of length 1");
  }
  const uint32_t materials = r->get_count(1, ObjectImages::most_materials, "materials");
  for (uint32_t m = 0; m < materials; ++m) {
    const RGB reflectance = r->get_share("a reflectance");
    o.materials.push_back({reflectance, r->get_share("a transmittance")});
  }
  const uint32_t levels = r->get_count(1, ObjectImages::most_levels, "levels");
  for (uint32_t l = 0; l < levels; ++l) {
    ImageLevel level;
    const uint32_t resolution =
        r->get_count(ObjectImages::coarsest_resolution, ObjectImages::largest_resolution, "texels a side");
    level.resolution = int(resolution);
    r->expect(l == 0 || o.levels.back().resolution == 2 * level.resolution, "a level is not half of the one before");
    for (uint32_t d = 0; d < directions; ++d) level.views.push_back(get_image(resolution, materials, r));
    o.levels.push_back(std::move(level));
  }
  return o;
}

}  // namespace

std::vector<std::byte> encode_images(const std::vector<ObjectImages>& objects) {
  Writer w;
  w.put(magic);
  w.put(version);
  w.put_count(objects.size());
  for (const ObjectImages& o : objects) put_object(o, &w);
  return std::move(w.bytes);
}

std::vector<ObjectImages> decode_images(std::span<const std::byte> bytes, const std::string& name) {
  Reader r(bytes, name);
  char found[sizeof magic];
  if (bytes.size() < sizeof magic) r.fail("no images of trees: the file is too short");
  r.get_all(found, sizeof magic, "the first bytes");
  if (std::memcmp(found, magic, sizeof magic) != 0)
    throw InputError(FileLoc{name, 0, 0}, "no images of trees; expected a file that `dapple trees bake` wrote");
  const auto its_version = r.get<uint32_t>("the version");
  if (its_version != version)
    r.fail("images of trees of version " + std::to_string(its_version) + ", expected " + std::to_string(version) +
           ": bake them again");
  const auto count = r.get<uint32_t>("the number of objects");
  std::vector<ObjectImages> objects;
  for (uint32_t o = 0; o < count; ++o) objects.push_back(get_object(&r));
  r.expect(r.at_end(), "bytes are left over");
  return objects;
}

void write_images(const std::string& path, const std::vector<ObjectImages>& objects) {
  const std::vector<std::byte> bytes = encode_images(objects);
  image::AtomicFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

std::vector<ObjectImages> read_images(const std::string& path) {
  if (const std::string why = why_unreadable(path); !why.empty()) throw IoError("cannot read \"" + path + "\": " + why);
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const auto size = in ? std::streamoff(in.tellg()) : -1;
  if (size < 0) throw IoError("cannot read \"" + path + "\"");
  if (size_t(size) > largest_file) throw InputError(FileLoc{path, 0, 0}, "no images of trees: larger than 8 GB");
  std::vector<std::byte> bytes(static_cast<size_t>(size));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), size);
  if (!in) throw IoError("cannot read \"" + path + "\"");
  return decode_images(bytes, path);
}

}  // namespace dapple::depthimage
