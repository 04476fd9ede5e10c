// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/unet.h"

#include <algorithm>
#include <array>
#include <compare>
#include <map>
#include <mutex>
#include <oneapi/dnnl/dnnl.hpp>
#include <optional>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/base/vec.h"

// Of the OpenMP that oneDNN runs on; its own loops are kept to the calling thread.
extern "C" void omp_set_num_threads(int);
extern "C" int omp_get_max_threads();

namespace dapple::denoise {

namespace {

using Tag = dnnl::memory::format_tag;
constexpr auto f32 = dnnl::memory::data_type::f32;
constexpr int block = 16;  // channels are padded to multiples of this, as vector code wants

int padded(int channels) {
  return (channels + block - 1) / block * block;
}

class OneThread {
 public:
  OneThread() : before_(omp_get_max_threads()) { omp_set_num_threads(1); }
  ~OneThread() { omp_set_num_threads(before_); }

 private:
  int before_;
};

struct Plane {
  int width = 0, height = 0, channels = 0;
  std::vector<float> values;
  Plane() = default;
  Plane(int w, int h, int c) : width(w), height(h), channels(c), values(static_cast<size_t>(w) * h * c) {}
  float* row(int y) { return &values[static_cast<size_t>(y) * width * channels]; }
  const float* row(int y) const { return &values[static_cast<size_t>(y) * width * channels]; }
};

/// Pixels [x0, x1) x [y0, y1).
struct Box {
  int x0, y0, x1, y1;
  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  size_t area() const { return static_cast<size_t>(width()) * height(); }
};

/// What a convolution reads for a box of a plane.
Box around(const Box& b, int width, int height) {
  return {std::max(0, b.x0 - 1), std::max(0, b.y0 - 1), std::min(width, b.x1 + 1), std::min(height, b.y1 + 1)};
}

/// Memory that threads work with, used again from band to band and layer to layer.
class Buffers {
 public:
  class Lease {
   public:
    Lease(Buffers& from, size_t size) : from_(from), values_(from.take()) {
      if (values_.size() < size) values_.resize(size);
    }
    ~Lease() { from_.give(std::move(values_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    float* data() { return values_.data(); }

   private:
    Buffers& from_;
    std::vector<float> values_;
  };

 private:
  std::vector<float> take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return {};
    std::vector<float> v = std::move(free_.back());
    free_.pop_back();
    return v;
  }
  void give(std::vector<float> values) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(values));
  }

  std::mutex mutex_;
  std::vector<std::vector<float>> free_;
};

struct Primitive {
  dnnl::convolution_forward::primitive_desc desc;
  dnnl::convolution_forward conv;
  dnnl::memory weights;
  size_t scratch = 0;  ///< floats
};

class Convolution {
 public:
  Convolution(const Tensor& weight, const Tensor& bias, int split, bool relu, const dnnl::engine& engine)
      : in_(padded(split) + padded(weight.shape[1] - split)),
        out_(padded(weight.shape[0])),
        relu_(relu),
        engine_(engine),
        weights_(static_cast<size_t>(in_) * out_ * 9),
        bias_(out_) {
    const int ni = weight.shape[1];
    flops_ = 18.0 * ni * weight.shape[0];
    for (int o = 0; o < weight.shape[0]; ++o) {
      bias_[o] = bias.values[o];
      for (int i = 0; i < ni; ++i) {
        const int at = i < split ? i : padded(split) + i - split;
        std::copy_n(&weight.values[(static_cast<size_t>(o) * ni + i) * 9], 9,
                    &weights_[(static_cast<size_t>(o) * in_ + at) * 9]);
      }
    }
  }

  int in() const { return in_; }
  int out() const { return out_; }
  double flops() const { return flops_; }  ///< a pixel, without what pads channels

  /// Of a plane of this size: reads the pixels around(box), which lie at `from` without gaps, and writes those of the
  /// box to `to`.
  void run(const Box& box, int width, int height, const float* from, float* to, Buffers& buffers) const {
    const std::shared_ptr<const Primitive> p =
        primitive({box.width(), box.height(), box.x0 == 0, box.x1 == width, box.y0 == 0, box.y1 == height});
    const auto memory = [&](const dnnl::memory::desc& desc, const float* data) {
      return dnnl::memory(desc, engine_, const_cast<float*>(data));
    };
    Buffers::Lease scratch(buffers, p->scratch);
    dnnl::stream stream(engine_);
    p->conv.execute(stream, {{DNNL_ARG_SRC, memory(p->desc.src_desc(), from)},
                             {DNNL_ARG_WEIGHTS, p->weights},
                             {DNNL_ARG_BIAS, memory(p->desc.bias_desc(), bias_.data())},
                             {DNNL_ARG_DST, memory(p->desc.dst_desc(), to)},
                             {DNNL_ARG_SCRATCHPAD, memory(p->desc.scratchpad_desc(), scratch.data())}});
    stream.wait();
  }

 private:
  /// Size of a box, and on which sides it ends with its plane, beyond which there are zeros.
  struct Kind {
    int width, height;
    bool left, right, top, bottom;
    auto operator<=>(const Kind&) const = default;
  };

  std::shared_ptr<const Primitive> primitive(const Kind& kind) const {
    const std::lock_guard lock(mutex_);
    if (primitives_.size() > most_primitives) primitives_.clear();
    std::shared_ptr<const Primitive>& p = primitives_[kind];
    if (!p) p = std::make_shared<const Primitive>(make(kind));
    return p;
  }

  Primitive make(const Kind& k) const {
    const OneThread guard;
    const dnnl::memory::desc src({1, in_, k.height + !k.top + !k.bottom, k.width + !k.left + !k.right}, f32, Tag::nhwc);
    const dnnl::memory::desc dst({1, out_, k.height, k.width}, f32, Tag::nhwc);
    const dnnl::memory::desc weights({out_, in_, 3, 3}, f32, Tag::any), bias({out_}, f32, Tag::a);
    const dnnl::convolution_forward::desc what(dnnl::prop_kind::forward_inference, dnnl::algorithm::convolution_direct,
                                               src, weights, bias, dst, {1, 1}, {k.top, k.left}, {k.bottom, k.right});
    dnnl::primitive_attr attributes;
    attributes.set_scratchpad_mode(dnnl::scratchpad_mode::user);
    if (relu_) {
      dnnl::post_ops after;
      after.append_eltwise(1, dnnl::algorithm::eltwise_relu, 0, 0);
      attributes.set_post_ops(after);
    }
    Primitive p;
    p.desc = dnnl::convolution_forward::primitive_desc(what, attributes, engine_);
    p.conv = dnnl::convolution_forward(p.desc);
    p.scratch = p.desc.scratchpad_desc().get_size() / sizeof(float) + 1;
    p.weights = dnnl::memory(p.desc.weights_desc(), engine_);
    dnnl::memory plain({{out_, in_, 3, 3}, f32, Tag::oihw}, engine_, const_cast<float*>(weights_.data()));
    dnnl::stream stream(engine_);
    dnnl::reorder(plain, p.weights).execute(stream, plain, p.weights);
    stream.wait();
    return p;
  }

  static constexpr size_t most_primitives = 128;  // pictures of many sizes must not fill memory

  int in_, out_;
  bool relu_;
  double flops_;
  dnnl::engine engine_;
  std::vector<float> weights_, bias_;
  mutable std::mutex mutex_;
  mutable std::map<Kind, std::shared_ptr<const Primitive>> primitives_;
};

/// Side of the boxes that a thread works on; smaller where planes are small. A multiple of 2; fixed, since results must
/// not depend on threads.
V2i box_size(int level) {
  return level < 2 ? V2i(128, 64) : level == 2 ? V2i(64, 32) : V2i(32, 16);
}

/// Convolutions one after the other, box by box with what is around it: no plane between them is ever whole, which
/// would take most of the memory and of the time. read(box, to) gives what enters, write(box, from) takes what comes
/// out.
template <class Read, class Write>
void chain(std::initializer_list<const Convolution*> convolutions, int width, int height, int level, Buffers& buffers,
           const StopToken& stop, const Read& read, const Write& write) {
  const V2i size = box_size(level);
  const int columns = (width + size.x - 1) / size.x, rows = (height + size.y - 1) / size.y;
  parallel_for(static_cast<size_t>(columns) * rows, [&](size_t i) {
    stop.check();
    const OneThread guard;
    const int x = static_cast<int>(i) % columns * size.x, y = static_cast<int>(i) / columns * size.y;
    constexpr size_t most = 3;
    std::array<Box, most + 1> boxes;  // what comes out of each but the first, which is what enters
    const size_t n = convolutions.size();
    boxes[n] = {x, y, std::min(width, x + size.x), std::min(height, y + size.y)};
    for (size_t k = n; k-- > 0;) boxes[k] = around(boxes[k + 1], width, height);
    std::array<std::optional<Buffers::Lease>, 2> values;
    values[0].emplace(buffers, boxes[0].area() * (*convolutions.begin())->in());
    read(boxes[0], values[0]->data());
    for (size_t k = 0; k < n; ++k) {
      const Convolution& c = *convolutions.begin()[k];
      std::optional<Buffers::Lease>& to = values[(k + 1) % 2];
      to.reset();
      to.emplace(buffers, boxes[k + 1].area() * c.out());
      c.run(boxes[k + 1], width, height, values[k % 2]->data(), to->data(), buffers);
    }
    write(boxes[n], values[n % 2]->data());
  });
}

/// Of a plane that exists.
struct ReadPlane {
  const Plane& plane;
  void operator()(const Box& b, float* to) const {
    for (int y = b.y0; y < b.y1; ++y)
      to = std::copy_n(plane.row(y) + static_cast<size_t>(b.x0) * plane.channels,
                       static_cast<size_t>(b.width()) * plane.channels, to);
  }
};

/// The picture, channels padded with zeros.
struct ReadPicture {
  std::span<const float> in;
  int width, channels;
  float* pixel(int x, int y, float* to) const {
    to = std::copy_n(&in[(static_cast<size_t>(y) * width + x) * channels], channels, to);
    return std::fill_n(to, padded(channels) - channels, 0.f);
  }
  void operator()(const Box& b, float* to) const {
    for (int y = b.y0; y < b.y1; ++y)
      for (int x = b.x0; x < b.x1; ++x) to = pixel(x, y, to);
  }
};

/// A plane of half the size, each pixel four times, and after it the channels of what was skipped, of the full size:
/// pixel(x, y, to).
template <class Skipped>
struct ReadJoined {
  const Plane& plane;
  Skipped skipped;
  void operator()(const Box& b, float* to) const {
    for (int y = b.y0; y < b.y1; ++y) {
      const float* const row = plane.row(y / 2);
      for (int x = b.x0; x < b.x1; ++x)
        to = skipped(x, y, std::copy_n(row + static_cast<size_t>(x / 2) * plane.channels, plane.channels, to));
    }
  }
};

struct WritePlane {
  Plane& plane;
  void operator()(const Box& b, const float* from) const {
    const size_t n = static_cast<size_t>(b.width()) * plane.channels;
    for (int y = b.y0; y < b.y1; ++y, from += n)
      std::copy_n(from, n, plane.row(y) + static_cast<size_t>(b.x0) * plane.channels);
  }
};

/// The largest of each 2 x 2 pixels, to a plane of half the size.
struct WritePooled {
  Plane& plane;
  void operator()(const Box& b, const float* from) const {
    const int n = plane.channels, row = b.width() * n;
    for (int y = b.y0; y < b.y1; y += 2, from += 2 * row) {
      float* to = plane.row(y / 2) + static_cast<size_t>(b.x0 / 2) * n;
      for (int x = 0; x < b.width(); x += 2)
        for (int c = 0; c < n; ++c) {
          const float* const p = from + x * n + c;
          *to++ = std::max(std::max(p[0], p[n]), std::max(p[row], p[row + n]));
        }
    }
  }
};

}  // namespace

struct UNet::Layers {
  dnnl::engine engine{dnnl::engine::kind::cpu, 0};
  std::vector<std::unique_ptr<const Convolution>> conv;  // in the order of `names`
  int inputs = 0, outputs = 0;
};

namespace {
constexpr std::array names = {"enc_conv0",  "enc_conv1",  "enc_conv2",  "enc_conv3",  "enc_conv4",  "enc_conv5a",
                              "enc_conv5b", "dec_conv4a", "dec_conv4b", "dec_conv3a", "dec_conv3b", "dec_conv2a",
                              "dec_conv2b", "dec_conv1a", "dec_conv1b", "dec_conv0"};
constexpr std::array levels = {0, 0, 1, 2, 3, 4, 4, 3, 3, 2, 2, 1, 1, 0, 0, 0};  // halvings of the picture
}  // namespace

UNet::UNet(const TensorMap& tensors, const std::string& name) : layers_(std::make_unique<Layers>()) {
  const auto fail = [&](const std::string& what) {
    throw InputError(FileLoc{name}, "not a network for denoising: " + what);
  };
  std::array<int, names.size()> out{};
  for (size_t i = 0; i < names.size(); ++i) {
    const auto w = tensors.find(std::string(names[i]) + ".weight"), b = tensors.find(std::string(names[i]) + ".bias");
    if (w == tensors.end() || b == tensors.end()) fail(std::string("no ") + names[i]);
    const auto& s = w->second.shape;
    if (s.size() != 4 || s[2] != 3 || s[3] != 3 || s[0] > 1024 || b->second.shape != std::vector<int>{s[0]})
      fail(std::string(names[i]) + " is no 3 x 3 convolution with a bias");
    out[i] = s[0];
    if (i == 0) layers_->inputs = s[1];
    const int before = i == 0 ? s[1] : out[i - 1];
    // What the decoder takes beside the layer below: the pooled enc_conv3, 2, 1, and the image.
    const int skip = i == 7 ? out[3] : i == 9 ? out[2] : i == 11 ? out[1] : i == 13 ? layers_->inputs : 0;
    if (s[1] != before + skip)
      fail(std::string(names[i]) + " takes " + std::to_string(s[1]) + " channels of " + std::to_string(before + skip));
    layers_->conv.push_back(
        std::make_unique<Convolution>(w->second, b->second, before, i + 1 < names.size(), layers_->engine));
  }
  layers_->outputs = out.back();
  if (layers_->inputs > 64) fail("more than 64 channels enter");
}

UNet::~UNet() = default;
int UNet::inputs() const {
  return layers_->inputs;
}
int UNet::outputs() const {
  return layers_->outputs;
}

void UNet::run(std::span<const float> in, int width, int height, std::span<float> out, StopToken stop) const {
  Buffers buffers;
  const auto conv = [&](int i) { return layers_->conv[size_t(i)].get(); };
  const auto size = [&](int level) { return V2i(width >> level, height >> level); };
  const auto run_chain = [&](std::initializer_list<const Convolution*> convolutions, int level, const auto& read,
                             const auto& write) {
    chain(convolutions, size(level).x, size(level).y, level, buffers, stop, read, write);
  };
  const auto pooled = [&](std::initializer_list<const Convolution*> convolutions, int level, const auto& read) {
    Plane result(size(level + 1).x, size(level + 1).y, convolutions.end()[-1]->out());
    run_chain(convolutions, level, read, WritePooled{result});
    return result;
  };
  const auto joined = [&](int first, int level, const Plane& x, const Plane& skip) {
    Plane result(size(level).x, size(level).y, conv(first + 1)->out());
    const auto skipped = [&](int px, int py, float* to) {
      return std::copy_n(skip.row(py) + static_cast<size_t>(px) * skip.channels, skip.channels, to);
    };
    run_chain({conv(first), conv(first + 1)}, level, ReadJoined<decltype(skipped)>{x, skipped}, WritePlane{result});
    return result;
  };
  const ReadPicture picture{in, width, inputs()};
  Plane p1 = pooled({conv(0), conv(1)}, 0, picture);
  Plane p2 = pooled({conv(2)}, 1, ReadPlane{p1}), p3 = pooled({conv(3)}, 2, ReadPlane{p2}),
        x = pooled({conv(4)}, 3, ReadPlane{p3});
  Plane deepest(x.width, x.height, conv(6)->out());
  run_chain({conv(5), conv(6)}, 4, ReadPlane{x}, WritePlane{deepest});
  x = joined(7, 3, deepest, p3);
  x = joined(9, 2, x, p2);
  x = joined(11, 1, x, p1);
  p1 = Plane();
  const int no = outputs(), padded_out = padded(no);
  const auto skipped = [&](int px, int py, float* to) { return picture.pixel(px, py, to); };
  run_chain({conv(13), conv(14), conv(15)}, 0, ReadJoined<decltype(skipped)>{x, skipped},
            [&](const Box& b, const float* from) {
              for (int y = b.y0; y < b.y1; ++y)
                for (int px = b.x0; px < b.x1; ++px, from += padded_out)
                  std::copy_n(from, no, &out[(static_cast<size_t>(y) * width + px) * no]);
            });
}

double UNet::flops(int width, int height) const {
  double sum = 0;
  for (size_t i = 0; i < layers_->conv.size(); ++i)
    sum += layers_->conv[i]->flops() * double(width >> levels[i]) * double(height >> levels[i]);
  return sum;
}

double UNet::bare_seconds(int width, int height) const {
  Buffers buffers;
  const auto nothing = [](const Box&, const float*) {};
  const auto pass = [&] {
    for (const auto& [first, count] :
         {std::pair(0, 2), {2, 1}, {3, 1}, {4, 1}, {5, 2}, {7, 2}, {9, 2}, {11, 2}, {13, 3}}) {
      const int level = levels[size_t(first)];
      const auto conv = [&, f = first](int i) { return layers_->conv[size_t(f + i)].get(); };
      const auto run_chain = [&](std::initializer_list<const Convolution*> convolutions) {
        chain(convolutions, width >> level, height >> level, level, buffers, {}, nothing, nothing);
      };
      if (count == 1) run_chain({conv(0)});
      if (count == 2) run_chain({conv(0), conv(1)});
      if (count == 3) run_chain({conv(0), conv(1), conv(2)});
    }
  };
  const Timer timer;
  pass();
  return timer.seconds();
}

std::string instruction_set() {
  switch (dnnl::get_effective_cpu_isa()) {
    case dnnl::cpu_isa::sse41:
      return "sse41";
    case dnnl::cpu_isa::avx:
      return "avx";
    case dnnl::cpu_isa::avx2:
      return "avx2";
    case dnnl::cpu_isa::avx2_vnni:
      return "avx2_vnni";
    case dnnl::cpu_isa::avx512_core:
      return "avx512_core";
    case dnnl::cpu_isa::avx512_core_vnni:
      return "avx512_core_vnni";
    case dnnl::cpu_isa::avx512_core_bf16:
      return "avx512_core_bf16";
    case dnnl::cpu_isa::avx512_core_amx:
      return "avx512_core_amx";
    default:
      return "isa " + std::to_string(static_cast<int>(dnnl::get_effective_cpu_isa()));
  }
}

}  // namespace dapple::denoise
