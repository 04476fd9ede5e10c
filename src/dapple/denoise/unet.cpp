// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/unet.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <oneapi/dnnl/dnnl.hpp>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"

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

/// A convolution of `rows` rows, of which the frame may end above or below.
struct Primitive {
  dnnl::convolution_forward::primitive_desc desc;
  dnnl::convolution_forward conv;
  dnnl::memory weights;
};

class Convolution {
 public:
  Convolution(const Tensor& weight, const Tensor& bias, int split, bool relu, const dnnl::engine& engine)
      : in_(padded(split) + padded(weight.shape[1] - split)), out_(padded(weight.shape[0])), relu_(relu), engine_(engine),
        weights_(static_cast<size_t>(in_) * out_ * 9), bias_(out_) {
    const int ni = weight.shape[1];
    for (int o = 0; o < weight.shape[0]; ++o) {
      bias_[o] = bias.values[o];
      for (int i = 0; i < ni; ++i) {
        const int at = i < split ? i : padded(split) + i - split;
        std::copy_n(&weight.values[(static_cast<size_t>(o) * ni + i) * 9], 9, &weights_[(static_cast<size_t>(o) * in_ + at) * 9]);
      }
    }
  }

  int out() const { return out_; }

  Plane operator()(const Plane& source, const StopToken& stop) const {
    Plane result(source.width, source.height, out_);
    const int bands = (source.height + band_rows - 1) / band_rows;
    const int last = source.height - (bands - 1) * band_rows;
    // First, middle and last band; a frame of one band is both first and last.
    std::array<Primitive, 3> kinds;
    kinds[0] = make(source.width, bands == 1 ? last : band_rows, true, bands == 1);
    if (bands > 2) kinds[1] = make(source.width, band_rows, false, false);
    if (bands > 1) kinds[2] = make(source.width, last, false, true);
    parallel_for(bands, [&](size_t band) {
      stop.check();
      const OneThread guard;
      const Primitive& p = kinds[band == 0 ? 0 : static_cast<int>(band) == bands - 1 ? 2 : 1];
      const int y = static_cast<int>(band) * band_rows;
      const auto memory = [&](const dnnl::memory::desc& desc, const float* data) {
        return dnnl::memory(desc, engine_, const_cast<float*>(data));
      };
      std::vector<std::byte> scratch(p.desc.scratchpad_desc().get_size() + 1);
      dnnl::stream stream(engine_);
      p.conv.execute(stream, {{DNNL_ARG_SRC, memory(p.desc.src_desc(), source.row(std::max(0, y - 1)))},
                              {DNNL_ARG_WEIGHTS, p.weights},
                              {DNNL_ARG_BIAS, memory(p.desc.bias_desc(), bias_.data())},
                              {DNNL_ARG_DST, memory(p.desc.dst_desc(), result.row(y))},
                              {DNNL_ARG_SCRATCHPAD, dnnl::memory(p.desc.scratchpad_desc(), engine_, scratch.data())}});
      stream.wait();
    });
    return result;
  }

 private:
  Primitive make(int width, int rows, bool top, bool bottom) const {
    const OneThread guard;
    const dnnl::memory::desc src({1, in_, rows + !top + !bottom, width}, f32, Tag::nhwc), dst({1, out_, rows, width}, f32, Tag::nhwc);
    const dnnl::memory::desc weights({out_, in_, 3, 3}, f32, Tag::any), bias({out_}, f32, Tag::a);
    const dnnl::convolution_forward::desc what(dnnl::prop_kind::forward_inference, dnnl::algorithm::convolution_direct, src, weights, bias,
                                               dst, {1, 1}, {top, 1}, {bottom, 1});
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
    p.weights = dnnl::memory(p.desc.weights_desc(), engine_);
    dnnl::memory plain({{out_, in_, 3, 3}, f32, Tag::oihw}, engine_, const_cast<float*>(weights_.data()));
    dnnl::stream stream(engine_);
    dnnl::reorder(plain, p.weights).execute(stream, plain, p.weights);
    stream.wait();
    return p;
  }

  int in_, out_;
  bool relu_;
  dnnl::engine engine_;
  std::vector<float> weights_, bias_;
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

/// `in` at twice its size, each pixel four times, and after it the channels of `skip`.
Plane join(const Plane& in, const Plane& skip) {
  Plane out(skip.width, skip.height, in.channels + skip.channels);
  parallel_for(out.height, [&](size_t y) {
    const float *a = in.row(static_cast<int>(y / 2)), *b = skip.row(static_cast<int>(y));
    float* to = out.row(static_cast<int>(y));
    for (int x = 0; x < out.width; ++x, to += out.channels)
      std::copy_n(b + x * skip.channels, skip.channels, std::copy_n(a + x / 2 * in.channels, in.channels, to));
  });
  return out;
}

}  // namespace

struct UNet::Layers {
  dnnl::engine engine{dnnl::engine::kind::cpu, 0};
  std::vector<Convolution> conv;  // in the order of `names`
  int inputs = 0, outputs = 0;
};

namespace {
constexpr std::array names = {"enc_conv0",  "enc_conv1",  "enc_conv2",  "enc_conv3",  "enc_conv4",  "enc_conv5a", "enc_conv5b", "dec_conv4a",
                              "dec_conv4b", "dec_conv3a", "dec_conv3b", "dec_conv2a", "dec_conv2b", "dec_conv1a", "dec_conv1b", "dec_conv0"};
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
    layers_->conv.emplace_back(w->second, b->second, before, i + 1 < names.size(), layers_->engine);
  }
  layers_->outputs = out.back();
  if (layers_->inputs > 64) fail("more than 64 channels enter");
}

UNet::~UNet() = default;
int UNet::inputs() const { return layers_->inputs; }
int UNet::outputs() const { return layers_->outputs; }

void UNet::run(std::span<const float> in, int width, int height, std::span<float> out, StopToken stop) const {
  const auto conv = [&](int layer, const Plane& source) { return layers_->conv[size_t(layer)](source, stop); };
  const int ni = inputs(), no = outputs();
  Plane image(width, height, padded(ni));
  const size_t pixels = static_cast<size_t>(width) * height;
  for (size_t i = 0; i < pixels; ++i) std::copy_n(&in[i * ni], ni, &image.values[i * image.channels]);
  const Plane p1 = pool(conv(1, conv(0, image)));
  const Plane p2 = pool(conv(2, p1)), p3 = pool(conv(3, p2));
  Plane x = conv(6, conv(5, pool(conv(4, p3))));
  x = conv(8, conv(7, join(x, p3)));
  x = conv(10, conv(9, join(x, p2)));
  x = conv(12, conv(11, join(x, p1)));
  x = conv(15, conv(14, conv(13, join(x, image))));
  for (size_t i = 0; i < pixels; ++i) std::copy_n(&x.values[i * x.channels], no, &out[i * no]);
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
