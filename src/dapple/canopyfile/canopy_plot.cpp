// SPDX-License-Identifier: Apache-2.0
#include "dapple/canopyfile/canopy_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace dapple::canopyfile {

namespace {

constexpr double pi_d = std::numbers::pi;
constexpr double panel_width = 400, panel_height = 410, margin_left = 62, margin_top = 44, plot_width = 310,
                 plot_height = 270;

template <class... A>
std::string text_of(const char* format, A... a) {
  char buffer[400];
  std::snprintf(buffer, sizeof buffer, format, a...);
  return buffer;
}

std::string escape(const std::string& s) {
  std::string out;
  for (char c : s) out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

/// A round step that cuts `span` into four to eight parts.
double round_step(double span) {
  const double raw = span / 5, decade = std::pow(10, std::floor(std::log10(raw)));
  for (double m : {1.0, 2.0, 5.0, 10.0})
    if (raw <= m * decade * 1.0001) return m * decade;
  return 10 * decade;
}

struct Range {
  double low = 0, high = 1;
  double at(double x) const { return (x - low) / (high - low); }
};

Range range_of(const std::vector<double>& x, bool from_zero) {
  Range r{from_zero ? 0 : 1e300, -1e300};
  for (double v : x)
    if (std::isfinite(v)) {
      r.low = std::min(r.low, v);
      r.high = std::max(r.high, v);
    }
  if (!(r.high > r.low)) r.high = r.low + (r.low == 0 ? 1 : std::abs(r.low));
  if (r.high < r.low) return {0, 1};
  return r;
}

/// Axes with grid, ticks and labels around the plot rectangle of a panel.
class Panel {
 public:
  Panel(std::string& svg, double x0, double y0, const std::string& title)
      : svg_(svg), left_(x0 + margin_left), top_(y0 + margin_top) {
    svg_ += text_of("<text x=\"%.1f\" y=\"%.1f\" font-weight=\"bold\" text-anchor=\"middle\">%s</text>\n",
                    left_ + plot_width / 2, top_ - 18, escape(title).c_str());
  }
  double x(double unit) const { return left_ + unit * plot_width; }
  double y(double unit) const { return top_ + (1 - unit) * plot_height; }

  void axes(const Range& h, const Range& v, const std::string& across, const std::string& upward, double step_h = 0) {
    const double sh = step_h > 0 ? step_h : round_step(h.high - h.low), sv = round_step(v.high - v.low);
    for (double t = std::ceil(h.low / sh - 1e-9) * sh; t <= h.high + 1e-9 * sh; t += sh) {
      svg_ += text_of("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>", x(h.at(t)), y(0),
                      x(h.at(t)), y(1));
      svg_ += text_of("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>\n", x(h.at(t)), y(0) + 16,
                      std::abs(t) < 1e-12 * sh ? 0.0 : t);
    }
    for (double t = std::ceil(v.low / sv - 1e-9) * sv; t <= v.high + 1e-9 * sv; t += sv) {
      svg_ += text_of("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>", x(0), y(v.at(t)), x(1),
                      y(v.at(t)));
      svg_ += text_of("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%.6g</text>\n", x(0) - 6, y(v.at(t)) + 4,
                      std::abs(t) < 1e-9 * sv ? 0.0 : t);
    }
    svg_ += text_of("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"none\" stroke=\"#333\"/>\n",
                    left_, top_, plot_width, plot_height);
    svg_ += text_of("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>\n", x(0.5), y(0) + 34,
                    escape(across).c_str());
    svg_ += text_of("<text transform=\"translate(%.1f %.1f) rotate(-90)\" text-anchor=\"middle\">%s</text>\n",
                    left_ - 50, y(0.5), escape(upward).c_str());
  }
  void line(const std::vector<std::array<double, 2>>& points, const char* colour, const char* dash) {
    svg_ += "<polyline fill=\"none\" stroke-width=\"1.8\" stroke=\"" + std::string(colour) + "\" stroke-dasharray=\"" +
            dash + "\" points=\"";
    for (const auto& p : points) svg_ += text_of("%.2f,%.2f ", x(p[0]), y(p[1]));
    svg_ += "\"/>\n";
  }
  /// Entries stand below the axes, three to a row, where no curve is.
  void legend(int entry, const std::string& label, const char* colour, const char* dash) {
    const double yy = y(0) + 54 + 16 * (entry / 3), xx = left_ - 30 + entry % 3 * 120.0;
    svg_ += text_of(
        "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" stroke-width=\"2\" "
        "stroke-dasharray=\"%s\"/>",
        xx, yy, xx + 26, yy, colour, dash);
    svg_ += text_of("<text x=\"%.1f\" y=\"%.1f\" font-size=\"11\">%s</text>\n", xx + 32, yy + 4, escape(label).c_str());
  }

 private:
  std::string& svg_;
  double left_, top_;
};

/// Perceptually even colours from dark blue over green to yellow.
std::array<int, 3> colour_of(double t) {
  static constexpr double stops[6][3] = {{68, 1, 84},    {65, 68, 135},  {42, 120, 142},
                                         {34, 168, 132}, {122, 209, 81}, {253, 231, 37}};
  t = std::clamp(t, 0.0, 1.0) * 5;
  const int i = std::min(4, static_cast<int>(t));
  std::array<int, 3> c{};
  for (int k = 0; k < 3; ++k)
    c[k] = static_cast<int>(std::lround(stops[i][k] + (t - i) * (stops[i + 1][k] - stops[i][k])));
  return c;
}

/// Up to three wavelengths are drawn: first, middle, last.
std::vector<int> drawn(int wavelengths) {
  if (wavelengths <= 3) {
    std::vector<int> all;
    for (int w = 0; w < wavelengths; ++w) all.push_back(w);
    return all;
  }
  return {0, wavelengths / 2, wavelengths - 1};
}

constexpr const char* colours[] = {"#c1272d", "#1b7837", "#2166ac"};

void draw_profile(std::string& svg, double x0, const CanopyInput& in, const CanopySolution& s) {
  Panel panel(svg, x0, 0, "Irradiance by height");
  const size_t all = in.wavelengths;
  std::vector<double> shown;
  for (int w : drawn(in.wavelengths))
    for (size_t l = 0; l < s.heights_m.size(); ++l) {
      const size_t at = l * all + w;
      shown.insert(shown.end(), {s.down_direct[at], s.down_diffuse[at], s.up[at]});
    }
  const Range h = range_of(shown, true), v{s.heights_m.front(), s.heights_m.back()};
  panel.axes(h, v, "irradiance (W m⁻²)", "height (m)");
  const std::vector<double>* kinds[] = {&s.down_direct, &s.down_diffuse, &s.up};
  const char* dashes[] = {"", "7 3", "2 3"};
  int colour = 0, entry = 0;
  for (int w : drawn(in.wavelengths)) {
    for (int k = 0; k < 3; ++k) {
      std::vector<std::array<double, 2>> points;
      for (size_t l = 0; l < s.heights_m.size(); ++l)
        points.push_back({h.at((*kinds[k])[l * all + w]), v.at(s.heights_m[l])});
      panel.line(points, colours[colour], dashes[k]);
    }
    if (all > 1) panel.legend(entry++, in.wavelength_name(w), colours[colour], "");
    ++colour;
  }
  const char* names[] = {"down, direct", "down, diffuse", "up"};
  for (int k = 0; k < 3; ++k) panel.legend(entry++, names[k], all > 1 ? "#333" : colours[0], dashes[k]);
}

void draw_principal_plane(std::string& svg, double x0, const CanopyInput& in, const CanopySolution& s) {
  Panel panel(svg, x0, 0, "Reflectance factor, principal plane");
  const size_t all = in.wavelengths;
  std::vector<double> shown;
  for (int w : drawn(in.wavelengths))
    for (int k = 0; k < s.principal_angles; ++k) shown.push_back(s.principal_plane[k * all + w]);
  Range v = range_of(shown, true);
  v.high *= 1.15;
  const Range h{-90, 90};
  panel.axes(h, v, "view zenith (degrees; negative: the sun's side)", "reflectance factor", 30);
  int colour = 0, entry = 0;
  for (int w : drawn(in.wavelengths)) {
    std::vector<std::array<double, 2>> points;
    for (int k = 0; k < s.principal_angles; ++k) {
      const double value = s.principal_plane[k * all + w];
      if (std::isfinite(value)) points.push_back({h.at(-85 + 170.0 * k / (s.principal_angles - 1)), v.at(value)});
    }
    panel.line(points, colours[colour], "");
    panel.legend(entry++, in.wavelength_name(w), colours[colour++], "");
  }
  if (in.sun) {
    const double at = panel.x(h.at(-in.sun->zenith_deg));
    svg +=
        text_of("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#e8a200\" stroke-dasharray=\"4 3\"/>",
                at, panel.y(0), at, panel.y(1));
    svg += text_of("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\" fill=\"#b87f00\" font-size=\"11\">sun</text>\n",
                   at, panel.y(1) - 4);
  }
}

void draw_polar(std::string& svg, double x0, const CanopyInput& in, const CanopySolution& s) {
  const size_t all = in.wavelengths;
  const int w = drawn(in.wavelengths).back();
  Panel panel(svg, x0, 0, "Reflectance factor by direction, " + in.wavelength_name(w));
  std::vector<double> shown;
  for (size_t i = w; i < s.polar.size(); i += all) shown.push_back(s.polar[i]);
  const Range value = range_of(shown, false);
  const double cx = panel.x(0.45), cy = panel.y(0.5), radius = 125;
  const auto ring = [&](double zenith) { return radius * zenith / 85; };
  // The sun's side is at the top; azimuth turns clockwise, as on a compass.
  for (int k = 0; k < s.polar_zeniths; ++k)
    for (int a = 0; a < s.polar_azimuths; ++a) {
      const double v = s.polar[(size_t(k) * s.polar_azimuths + a) * all + w];
      const double r0 = radius * k / s.polar_zeniths, r1 = radius * (k + 1.0) / s.polar_zeniths;
      const double a0 = 2 * pi_d * a / s.polar_azimuths, a1 = 2 * pi_d * (a + 1) / s.polar_azimuths;
      const auto c = std::isfinite(v) ? colour_of(value.at(v)) : std::array<int, 3>{200, 200, 200};
      const std::string rgb = text_of("#%02x%02x%02x", c[0], c[1], c[2]);
      svg += text_of(
          "<path d=\"M%.2f %.2fL%.2f %.2fL%.2f %.2fL%.2f %.2fZ\" fill=\"%s\" stroke=\"%s\" stroke-width=\".5\"/>\n",
          cx + r0 * std::sin(a0), cy - r0 * std::cos(a0), cx + r1 * std::sin(a0), cy - r1 * std::cos(a0),
          cx + r1 * std::sin(a1), cy - r1 * std::cos(a1), cx + r0 * std::sin(a1), cy - r0 * std::cos(a1), rgb.c_str(),
          rgb.c_str());
    }
  for (int zenith : {30, 60})
    svg += text_of(
        "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" fill=\"none\" stroke=\"#fff\" stroke-opacity=\".6\"/><text "
        "x=\"%.1f\" y=\"%.1f\" fill=\"#fff\" "
        "font-size=\"10\">%d°</text>\n",
        cx, cy, ring(zenith), cx + 3, cy + ring(zenith) - 3, zenith);
  if (in.sun && in.sun->zenith_deg <= 85)
    svg += text_of("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"#ffd34d\" stroke=\"#333\"/>\n", cx,
                   cy - ring(in.sun->zenith_deg));
  svg += text_of("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>\n", cx, cy + radius + 22,
                 in.sun ? "top: towards the sun" : "top: azimuth 0");
  for (int k = 0; k < 60; ++k) {
    const auto c = colour_of((k + 0.5) / 60);
    svg += text_of("<rect x=\"%.1f\" y=\"%.2f\" width=\"14\" height=\"4.2\" fill=\"#%02x%02x%02x\"/>\n", panel.x(0.93),
                   cy + 120 - 4 * (k + 1), c[0], c[1], c[2]);
  }
  for (double t : {0.0, 0.5, 1.0})
    svg += text_of("<text x=\"%.1f\" y=\"%.1f\" font-size=\"10\">%.3g</text>\n", panel.x(0.93) + 18, cy + 124 - 240 * t,
                   value.low + t * (value.high - value.low));
}

}  // namespace

std::string canopy_svg(const CanopyInput& in, const CanopySolution& s) {
  std::string svg = text_of(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\" "
      "font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
      3 * panel_width + 30, panel_height, 3 * panel_width + 30, panel_height);
  draw_profile(svg, 0, in, s);
  draw_principal_plane(svg, panel_width, in, s);
  draw_polar(svg, 2 * panel_width, in, s);
  return svg + "</svg>\n";
}

}  // namespace dapple::canopyfile
