// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/unet.h"

#include <algorithm>
#include <array>
#include <compare>
#include <map>
#include <mutex>
#include <oneapi/dnnl/dnnl.hpp>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"

// Of the OpenMP that oneDNN runs on; its own loops are kept to the calling thread.
extern "C" void omp_set_num_threads(int);
extern "C" int omp_get_max_threads();

namespace dapple::denoise {

namespace {

using Tag = dnnl::memory::format_tag;
constexpr auto f32 = dnnl::memory::data_type::f32;
constexpr int block = 16;      // channels are padded to multiples of this, as vector code wants
constexpr int band_rows = 16;  // fixed: results must not depend on threads

int padded(int channels) { return (channels + block - 1) / block * block; }

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

/// What enters a convolution: a plane; or one of half the size, each pixel four times, and after it the channels of `skip`. Joined
/// a band at a time, since whole joined planes would be the largest by far.
struct Source {
  const Plane& plane;
  const Plane* skip = nullptr;

  int width() const { return skip ? skip->width : plane.width; }
  int height() const { return skip ? skip->height : plane.height; }
  void join(int begin, int end, float* to) const {
    for (int y = begin; y < end; ++y) {
      const float *a = plane.row(y / 2), *b = skip->row(y);
      for (int x = 0; x < skip->width; ++x)
        to = std::copy_n(b + x * skip->channels, skip->channels, std::copy_n(a + x / 2 * plane.channels, plane.channels, to));
    }
  }
};

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

/// A convolution of `rows` rows, of which the frame may end above or below.
struct Primitive {
  dnnl::convolution_forward::primitive_desc desc;
  dnnl::convolution_forward conv;
  dnnl::memory weights;
  size_t scratch = 0;  ///< floats
};

class Convolution {
 public:
  Convolution(const Tensor& weight, const Tensor& bias, int split, bool relu, const dnnl::engine& engine)
      : in_(padded(split) + padded(weight.shape[1] - split)), out_(padded(weight.shape[0])), relu_(relu), engine_(engine),
        weights_(static_cast<size_t>(in_) * out_ * 9), bias_(out_) {
    const int ni = weight.shape[1];
    flops_ = 18.0 * ni * weight.shape[0];
    for (int o = 0; o < weight.shape[0]; ++o) {
      bias_[o] = bias.values[o];
      for (int i = 0; i < ni; ++i) {
        const int at = i < split ? i : padded(split) + i - split;
        std::copy_n(&weight.values[(static_cast<size_t>(o) * ni + i) * 9], 9, &weights_[(static_cast<size_t>(o) * in_ + at) * 9]);
      }
    }
  }

  int in() const { return in_; }
  int out() const { return out_; }
  double flops() const { return flops_; }  ///< a pixel, without what pads channels

  Plane operator()(const Source& source, Buffers& buffers, const StopToken& stop) const {
    const int width = source.width(), height = source.height();
    Plane result(width, height, out_);
    run(width, height, buffers, stop, [&](int y, int begin, int end, const auto& convolve) {
      if (!source.skip) return convolve(source.plane.row(begin), result.row(y));
      Buffers::Lease joined(buffers, static_cast<size_t>(end - begin) * width * in_);
      source.join(begin, end, joined.data());
      convolve(joined.data(), result.row(y));
    });
    return result;
  }
  /// The same without data, for benchmarks.
  void run_bare(const Plane& source, Plane& result, Buffers& buffers) const {
    run(source.width, source.height, buffers, {}, [&](int y, int begin, int, const auto& convolve) { convolve(source.row(begin), result.row(y)); });
  }

 private:
  // First, middle and last bands; one that is both.
  struct Kind {
    int width, rows;
    bool top, bottom;
    auto operator<=>(const Kind&) const = default;
  };

  /// Calls body(y, begin, end, convolve) for each band from row y, which reads rows [begin, end): convolve(from, to) does it.
  template <class Body>
  void run(int width, int height, Buffers& buffers, const StopToken& stop, const Body& body) const {
    const int bands = (height + band_rows - 1) / band_rows;
    const auto rows_of = [&](int band) { return std::min(band_rows, height - band * band_rows); };
    const auto kind_of = [&](int band) { return Kind{width, rows_of(band), band == 0, band == bands - 1}; };
    std::array<std::shared_ptr<const Primitive>, 3> kinds{primitive(kind_of(0)), primitive(kind_of(bands / 2)), primitive(kind_of(bands - 1))};
    parallel_for(bands, [&](size_t i) {
      stop.check();
      const OneThread guard;
      const int band = static_cast<int>(i), y = band * band_rows;
      const Primitive& p = *kinds[band == 0 ? 0 : band == bands - 1 ? 2 : 1];
      body(y, std::max(0, y - 1), std::min(height, y + rows_of(band) + 1), [&](const float* from, float* to) {
        const auto memory = [&](const dnnl::memory::desc& desc, const float* data) { return dnnl::memory(desc, engine_, const_cast<float*>(data)); };
        Buffers::Lease scratch(buffers, p.scratch);
        dnnl::stream stream(engine_);
        p.conv.execute(stream, {{DNNL_ARG_SRC, memory(p.desc.src_desc(), from)},
                                {DNNL_ARG_WEIGHTS, p.weights},
                                {DNNL_ARG_BIAS, memory(p.desc.bias_desc(), bias_.data())},
                                {DNNL_ARG_DST, memory(p.desc.dst_desc(), to)},
                                {DNNL_ARG_SCRATCHPAD, memory(p.desc.scratchpad_desc(), scratch.data())}});
        stream.wait();
      });
    });
  }

  std::shared_ptr<const Primitive> primitive(const Kind& kind) const {
    const std::lock_guard lock(mutex_);
    if (primitives_.size() > most_primitives) primitives_.clear();
    std::shared_ptr<const Primitive>& p = primitives_[kind];
    if (!p) p = std::make_shared<const Primitive>(make(kind));
    return p;
  }

  Primitive make(const Kind& k) const {
    const OneThread guard;
    const dnnl::memory::desc src({1, in_, k.rows + !k.top + !k.bottom, k.width}, f32, Tag::nhwc), dst({1, out_, k.rows, k.width}, f32, Tag::nhwc);
    const dnnl::memory::desc weights({out_, in_, 3, 3}, f32, Tag::any), bias({out_}, f32, Tag::a);
    const dnnl::convolution_forward::desc what(dnnl::prop_kind::forward_inference, dnnl::algorithm::convolution_direct, src, weights, bias,
                                               dst, {1, 1}, {k.top, 1}, {k.bottom, 1});
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

  static constexpr size_t most_primitives = 64;  // pictures of many sizes must not fill memory

  int in_, out_;
  bool relu_;
  double flops_;
  dnnl::engine engine_;
  std::vector<float> weights_, bias_;
  mutable std::mutex mutex_;
  mutable std::map<Kind, std::shared_ptr<const Primitive>> primitives_;
};

/// The largest of each 2 x 2 pixels.
Plane pool(const Plane& in) {
  Plane out(in.width / 2, in.height / 2, in.channels);
  parallel_for(out.height, [&](size_t y) {
    const float *upper = in.row(static_cast<int>(2 * y)), *lower = in.row(static_cast<int>(2 * y + 1));
    float* to = out.row(static_cast<int>(y));
    const int n = in.channels;
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < n; ++c) {
        const int i = 2 * x * n + c;
        to[x * n + c] = std::max(std::max(upper[i], upper[i + n]), std::max(lower[i], lower[i + n]));
      }
  });
  return out;
}

}  // namespace

struct UNet::Layers {
  dnnl::engine engine{dnnl::engine::kind::cpu, 0};
  std::vector<std::unique_ptr<const Convolution>> conv;  // in the order of `names`
  int inputs = 0, outputs = 0;
};

namespace {
constexpr std::array names = {"enc_conv0",  "enc_conv1",  "enc_conv2",  "enc_conv3",  "enc_conv4",  "enc_conv5a", "enc_conv5b", "dec_conv4a",
                              "dec_conv4b", "dec_conv3a", "dec_conv3b", "dec_conv2a", "dec_conv2b", "dec_conv1a", "dec_conv1b", "dec_conv0"};
constexpr std::array scale = {1, 1, 2, 4, 8, 16, 16, 8, 8, 4, 4, 2, 2, 1, 1, 1};  // of the picture over that of the layer's planes
}

UNet::UNet(const TensorMap& tensors, const std::string& name) : layers_(std::make_unique<Layers>()) {
  const auto fail = [&](const std::string& what) { throw InputError(FileLoc{name}, "not a network for denoising: " + what); };
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
    if (s[1] != before + skip) fail(std::string(names[i]) + " takes " + std::to_string(s[1]) + " channels of " + std::to_string(before + skip));
    layers_->conv.push_back(std::make_unique<Convolution>(w->second, b->second, before, i + 1 < names.size(), layers_->engine));
  }
  layers_->outputs = out.back();
  if (layers_->inputs > 64) fail("more than 64 channels enter");
}

UNet::~UNet() = default;
int UNet::inputs() const { return layers_->inputs; }
int UNet::outputs() const { return layers_->outputs; }

void UNet::run(std::span<const float> in, int width, int height, std::span<float> out, StopToken stop) const {
  Buffers buffers;
  const auto conv = [&](int layer, const Plane& source, const Plane* skip = nullptr) { return (*layers_->conv[size_t(layer)])({source, skip}, buffers, stop); };
  const int ni = inputs(), no = outputs();
  Plane image(width, height, padded(ni));
  const size_t pixels = static_cast<size_t>(width) * height;
  for (size_t i = 0; i < pixels; ++i) std::copy_n(&in[i * ni], ni, &image.values[i * image.channels]);
  Plane p1 = pool(conv(1, conv(0, image)));
  Plane p2 = pool(conv(2, p1)), p3 = pool(conv(3, p2));
  Plane x = conv(6, conv(5, pool(conv(4, p3))));
  x = conv(8, conv(7, x, &p3));
  x = conv(10, conv(9, x, &p2));
  x = conv(12, conv(11, x, &p1));
  p1 = p2 = p3 = Plane();
  x = conv(13, x, &image);
  image = Plane();
  x = conv(14, x);
  x = conv(15, x);
  for (size_t i = 0; i < pixels; ++i) std::copy_n(&x.values[i * x.channels], no, &out[i * no]);
}

double UNet::flops(int width, int height) const {
  double sum = 0;
  for (size_t i = 0; i < layers_->conv.size(); ++i) sum += layers_->conv[i]->flops() * (double(width) / scale[i]) * (double(height) / scale[i]);
  return sum;
}

double UNet::bare_seconds(int width, int height) const {
  Buffers buffers;
  double seconds = 0;
  for (size_t i = 0; i < layers_->conv.size(); ++i) {
    const Convolution& c = *layers_->conv[i];
    const int w = width / scale[i], h = height / scale[i];
    const Plane source(w, h, c.in());
    Plane result(w, h, c.out());
    const Timer timer;
    c.run_bare(source, result, buffers);
    seconds += timer.seconds();
  }
  return seconds;
}

std::string instruction_set() {
  switch (dnnl::get_effective_cpu_isa()) {
    case dnnl::cpu_isa::sse41: return "sse41";
    case dnnl::cpu_isa::avx: return "avx";
    case dnnl::cpu_isa::avx2: return "avx2";
    case dnnl::cpu_isa::avx512_core: return "avx512_core";
    case dnnl::cpu_isa::avx512_core_vnni: return "avx512_core_vnni";
    case dnnl::cpu_isa::avx512_core_bf16: return "avx512_core_bf16";
    default: return "isa " + std::to_string(static_cast<int>(dnnl::get_effective_cpu_isa()));
  }
}

}  // namespace dapple::denoise
