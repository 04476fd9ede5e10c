// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/guarded_light.h"

#include <algorithm>
#include <set>

namespace dapple::shading {

// False where the shader throws, which counts where a point is alone.
bool GuardedLight::attempt(const emitters::LightPoints& points, RGB* L) const {
  const auto caught = [&](const char* what) {
    if (points.count > 1) return;
    const std::lock_guard lock(mutex_);
    if (faults_.thrown++ == 0 || what < faults_.message) faults_.message = what;
  };
  try {
    shader_->emission(points, L);
    return true;
  } catch (const std::exception& e) {
    caught(e.what());
  } catch (...) {
    caught("what is not a std::exception");
  }
  return false;
}

void GuardedLight::emission(const emitters::LightPoints& points, RGB* L) const {
  RGB before[emitters::LightPoints::capacity];
  std::copy_n(L, points.count, before);
  if (!attempt(points, L)) {
    emitters::LightPoints one;
    one.count = 1;
    for (int i = 0; i < points.count; ++i) {
      for (const auto lanes : {&emitters::LightPoints::P, &emitters::LightPoints::N, &emitters::LightPoints::d,
                               &emitters::LightPoints::local})
        (one.*lanes).set(0, (points.*lanes)[i]);
      one.u[0] = points.u[i], one.v[0] = points.v[i];
      L[i] = before[i];
      if (points.count > 1 ? !attempt(one, L + i) : true) L[i] = RGB(1, 0, 1) * before[i].luminance();
    }
  }
  uint64_t bad = 0;
  for (int i = 0; i < points.count; ++i) {
    if (L[i].is_finite() && L[i].min() >= 0) continue;
    L[i] = L[i].is_finite() ? RGB(std::max(L[i].r, 0.0f), std::max(L[i].g, 0.0f), std::max(L[i].b, 0.0f)) : RGB();
    ++bad;
  }
  if (bad == 0) return;
  const std::lock_guard lock(mutex_);
  faults_.bad += bad;
}

GuardedMaterial::Faults GuardedLight::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

void add_light_faults(const std::vector<std::unique_ptr<const emitters::Light>>& lights, ShaderFaults* all) {
  std::set<const emitters::LightShader*> seen;
  for (const auto& light : lights) {
    const auto* guarded = dynamic_cast<const GuardedLight*>(light->shader());
    if (!guarded || !seen.insert(guarded).second) continue;
    const GuardedMaterial::Faults faults = guarded->faults();
    const auto at = [](uint64_t n) { return " at " + std::to_string(n) + (n == 1 ? " point" : " points"); };
    if (faults.thrown > 0)
      all->errors.push_back(guarded->name() + ": emission threw" + at(faults.thrown) +
                            ", whose light is magenta: " + faults.message);
    if (faults.bad > 0)
      all->warnings.push_back(guarded->name() + ": emission gave values that are wrong" + at(faults.bad) +
                              "; they are replaced");
  }
}

}  // namespace dapple::shading
