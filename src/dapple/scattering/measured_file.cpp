// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/measured_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>

#include "dapple/numeric/spectrum.h"

namespace dapple::scattering {

namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view tensor_magic("tensor_file\0", 12);

class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> all) : all_(all) {}

  template <class T>
  T read() {
    T value;
    if (all_.size() - at_ < sizeof(T)) throw std::runtime_error("it ends within its header");
    std::memcpy(&value, all_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string text(size_t size) {
    if (all_.size() - at_ < size) throw std::runtime_error("it ends within its header");
    const auto* begin = reinterpret_cast<const char*>(all_.data() + at_);
    at_ += size;
    return std::string(begin, size);
  }
  std::span<const std::byte> all() const { return all_; }

 private:
  std::span<const std::byte> all_;
  size_t at_ = 0;
};

/// A list of numbers of a tensor file.
struct Field {
  std::vector<size_t> shape;
  const std::byte* data = nullptr;

  size_t count() const {
    size_t n = 1;
    for (const size_t s : shape) n *= s;
    return n;
  }
  float at(size_t i) const {
    float value;
    std::memcpy(&value, data + i * sizeof(float), sizeof(float));
    return value;
  }
  std::vector<float> numbers() const {
    std::vector<float> all(count());
    std::memcpy(all.data(), data, all.size() * sizeof(float));
    return all;
  }
};

class TensorFile {
 public:
  explicit TensorFile(Bytes in) {
    in.text(tensor_magic.size());
    const auto major = in.read<uint8_t>(), minor = in.read<uint8_t>();
    if (major != 1 || minor != 0) throw std::runtime_error("it is a tensor file of a version other than 1.0");
    const auto fields = in.read<uint32_t>();
    for (uint32_t i = 0; i < fields; ++i) read_field(in);  // ends where the bytes do
  }

  const Field* find(const std::string& name) const {
    const auto it = fields_.find(name);
    return it == fields_.end() ? nullptr : &it->second;
  }
  const Field& get(const std::string& name, size_t dimensions) const {
    const Field* f = find(name);
    if (!f) throw std::runtime_error("it has no field \"" + name + "\" of 32-bit floats");
    if (f->shape.size() != dimensions)
      throw std::runtime_error("its field \"" + name + "\" has " + std::to_string(f->shape.size()) +
                               " dimensions; expected " + std::to_string(dimensions));
    return *f;
  }

 private:
  void read_field(Bytes& in) {
    constexpr uint8_t float32 = 10;
    const std::string name = in.text(in.read<uint16_t>());
    const auto dimensions = in.read<uint16_t>();
    const auto type = in.read<uint8_t>();
    const auto offset = in.read<uint64_t>();
    Field field;
    size_t count = 1;
    for (int k = 0; k < dimensions; ++k) {
      const auto size = in.read<uint64_t>();
      if (size == 0 || size > in.all().size() || count > in.all().size() / size)
        throw std::runtime_error("its field \"" + printable(name) + "\" is larger than the file");
      count *= size_t(size);
      field.shape.push_back(size_t(size));
    }
    if (type != float32) return;
    if (offset > in.all().size() || (in.all().size() - offset) / sizeof(float) < count)
      throw std::runtime_error("its field \"" + printable(name) + "\" reaches beyond its end");
    field.data = in.all().data() + offset;
    fields_[name] = std::move(field);
  }
  static std::string printable(const std::string& text) {
    std::string out;
    for (const char c : text.substr(0, 40)) out += c >= 32 && c < 127 ? c : '?';
    return out;
  }

  std::map<std::string, Field> fields_;
};

void require_shape(const std::string& name, const Field& f, std::initializer_list<size_t> first) {
  size_t k = 0;
  for (const size_t n : first)
    if (f.shape[k++] != n)
      throw std::runtime_error("the sizes of its field \"" + name + "\" do not go with the others");
  if (f.shape[f.shape.size() - 1] < 2 || f.shape[f.shape.size() - 2] < 2)
    throw std::runtime_error("its field \"" + name + "\" has fewer than 2 x 2 values");
}

std::vector<float> increasing(const std::string& name, const Field& f) {
  std::vector<float> all = f.numbers();
  for (size_t i = 0; i < all.size(); ++i)
    if (!std::isfinite(all[i]) || (i > 0 && !(all[i] > all[i - 1])))
      throw std::runtime_error("the numbers of its field \"" + name + "\" do not increase");
  return all;
}

/// What one value of a spectrum adds to each colour: that of a spectrum which is 1 there and falls to 0 at its
/// neighbours.
std::vector<RGB> colors_of(const std::vector<float>& wavelengths) {
  std::vector<RGB> weights;
  const size_t n = wavelengths.size();
  for (size_t i = 0; i < n; ++i) {
    std::vector<float> at, value;
    const auto add = [&](float x, float y) { at.push_back(x), value.push_back(y); };
    if (i > 0) add(wavelengths[i - 1], 0);
    add(wavelengths[i], 1);
    if (i + 1 < n) add(wavelengths[i + 1], 0);
    weights.push_back(unbounded_to_rgb(SampledSpectrum(at, value)));
  }
  return weights;
}

WarpTable table_of(const Field& f, bool normalised) {
  const size_t d = f.shape.size();
  if (f.shape[d - 1] > 1 << 14 || f.shape[d - 2] > 1 << 14) throw std::runtime_error("its tables are too large");
  return WarpTable(f.numbers(), int(f.shape[d - 2]), int(f.shape[d - 1]), normalised);
}

MeasuredTable::Adaptive adaptive_of(const TensorFile& file) {
  MeasuredTable::Adaptive out;
  out.phi = increasing("phi_i", file.get("phi_i", 1));
  out.theta = increasing("theta_i", file.get("theta_i", 1));
  const size_t phis = out.phi.size(), thetas = out.theta.size();
  const Field &normals = file.get("ndf", 2), &area = file.get("sigma", 2), &visible = file.get("vndf", 4),
              &luminance = file.get("luminance", 4);
  require_shape("ndf", normals, {});
  require_shape("sigma", area, {});
  require_shape("vndf", visible, {phis, thetas});
  require_shape("luminance", luminance, {phis, thetas});
  out.normals = table_of(normals, false);
  out.area = table_of(area, false);
  out.visible = table_of(visible, true);
  out.luminance = table_of(luminance, true);

  const bool has_rgb = file.find("rgb") != nullptr;
  const std::string name = has_rgb ? "rgb" : "spectra";
  const Field& values = file.get(name, 5);
  const size_t channels = has_rgb ? 3 : values.shape[2];
  require_shape(name, values, {phis, thetas, channels});
  std::vector<RGB> weights;
  if (has_rgb) {
    weights = {RGB(1, 0, 0), RGB(0, 1, 0), RGB(0, 0, 1)};
  } else {
    const std::vector<float> wavelengths = increasing("wavelengths", file.get("wavelengths", 1));
    if (!(wavelengths.front() > 0)) throw std::runtime_error("its wavelengths are not above 0");
    if (wavelengths.size() != channels) throw std::runtime_error("its spectra have not as many values as wavelengths");
    weights = colors_of(wavelengths);
  }
  const size_t height = values.shape[3], width = values.shape[4], cells = height * width;
  if (height > 1 << 14 || width > 1 << 14) throw std::runtime_error("its tables are too large");
  for (int c = 0; c < 3; ++c) {
    std::vector<float> color(phis * thetas * cells);
    for (size_t s = 0; s < phis * thetas; ++s)
      for (size_t k = 0; k < channels; ++k) {
        const float weight = weights[k][c];
        if (weight == 0) continue;
        for (size_t i = 0; i < cells; ++i) color[s * cells + i] += weight * values.at((s * channels + k) * cells + i);
      }
    out.colors[c] = WarpTable(std::move(color), int(height), int(width), false);
  }
  return out;
}

MeasuredTable::HalfAngle half_angle_of(Bytes in) {
  using Table = MeasuredTable::HalfAngle;
  constexpr size_t count = size_t(Table::half) * Table::polar * Table::azimuth;
  constexpr double scale[] = {1 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};
  for (const int size : {Table::half, Table::polar, Table::azimuth})
    if (in.read<int32_t>() != size) throw std::runtime_error("its table is not one of 90 x 90 x 180 values");
  if (in.all().size() != 12 + 3 * count * sizeof(double))
    throw std::runtime_error("it has " + std::to_string(in.all().size()) + " bytes; a MERL table has " +
                             std::to_string(12 + 3 * count * sizeof(double)));
  Table table;
  table.values.resize(count);
  const std::byte* at = in.all().data() + 12;
  for (int c = 0; c < 3; ++c)
    for (size_t i = 0; i < count; ++i, at += sizeof(double)) {
      double value;
      std::memcpy(&value, at, sizeof value);
      table.values[i][c] = float(value * scale[c]);
    }
  return table;
}

}  // namespace

std::shared_ptr<const MeasuredTable> read_measured(std::span<const std::byte> file) {
  const bool is_tensor =
      file.size() >= tensor_magic.size() && std::memcmp(file.data(), tensor_magic.data(), tensor_magic.size()) == 0;
  if (is_tensor) return std::make_shared<MeasuredTable>(adaptive_of(TensorFile(Bytes(file))));
  int32_t first = 0;
  if (file.size() >= sizeof first) std::memcpy(&first, file.data(), sizeof first);
  if (first != MeasuredTable::HalfAngle::half)
    throw std::runtime_error("it is neither a tensor file (.bsdf) nor a MERL table (.binary)");
  return std::make_shared<MeasuredTable>(half_angle_of(Bytes(file)));
}

}  // namespace dapple::scattering
