// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <fstream>

#include "dapple/numeric/spectrum.h"

namespace dapple {
inline namespace numeric {
namespace {

constexpr size_t max_file_size = size_t(4) << 20;

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == '\f' || c == '\v';
}

/// The numbers of a text, one at a time, with their places.
class Numbers {
 public:
  Numbers(std::string_view text, const std::string& name) : text_(text), loc_{name, 1, 1} {}

  FileLoc loc() const { return loc_; }

  /// False at the end. Leaves loc() at the number.
  bool next(float* out) {
    while (at_ < text_.size() && (is_space(text_[at_]) || text_[at_] == '#')) {
      if (text_[at_] == '#')
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      if (at_ < text_.size() && text_[at_++] == '\n') {
        ++loc_.line;
        line_start_ = at_;
      }
    }
    loc_.column = static_cast<uint32_t>(at_ - line_start_ + 1);
    if (at_ == text_.size()) return false;
    size_t end = at_;
    while (end < text_.size() && !is_space(text_[end]) && text_[end] != '#') ++end;
    const char* first = text_.data() + at_ + (text_[at_] == '+' ? 1 : 0);
    const char* last = text_.data() + end;
    double value = 0;
    const auto [stop, error] = std::from_chars(first, last, value);
    if (error != std::errc() || stop != last || !std::isfinite(static_cast<float>(value)))
      throw InputError(loc_, "\"" + std::string(text_.substr(at_, std::min<size_t>(end - at_, 40))) +
                                 "\" is not a number; expected pairs of wavelength (nm) and value");
    *out = static_cast<float>(value);
    at_ = end;
    return true;
  }

 private:
  std::string_view text_;
  FileLoc loc_;
  size_t at_ = 0, line_start_ = 0;
};

}  // namespace

SampledSpectrum parse_spectrum(std::string_view text, const std::string& name) {
  Numbers numbers(text, name);
  std::vector<float> wavelengths, values;
  float wavelength, value;
  while (numbers.next(&wavelength)) {
    const FileLoc loc = numbers.loc();
    if (!(wavelength > (wavelengths.empty() ? 0.0f : wavelengths.back())))
      throw InputError(loc, "wavelength out of order; expected positive wavelengths (nm) that increase");
    if (!numbers.next(&value)) throw InputError(loc, "a wavelength without a value");
    wavelengths.push_back(wavelength);
    values.push_back(value);
  }
  if (values.empty()) throw InputError({name, 0, 0}, "an empty spectrum; expected pairs of wavelength (nm) and value");
  return {std::move(wavelengths), std::move(values)};
}

SampledSpectrum read_spectrum_file(const std::string& path, const FileLoc& loc) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(loc, "cannot open spectrum file \"" + path + "\"");
  std::string text(max_file_size + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (file.fail() && !file.eof())) throw InputError(loc, "cannot read spectrum file \"" + path + "\"");
  text.resize(static_cast<size_t>(file.gcount()));
  if (text.size() > max_file_size) throw InputError(loc, "spectrum file \"" + path + "\" is larger than 4 MiB");
  return parse_spectrum(text, path);
}

}  // namespace numeric
}  // namespace dapple
