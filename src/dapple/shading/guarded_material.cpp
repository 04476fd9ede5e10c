// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/guarded_material.h"

#include <algorithm>

namespace dapple::shading {

namespace {

constexpr int capacity = pattern::ShadingPoints::capacity;
constexpr RGB magenta{1, 0, 1};

bool is_usable(float v) {
  return v >= 0 && v < infinity;
}
bool is_usable(const RGB& c) {
  return is_usable(c.r) && is_usable(c.g) && is_usable(c.b);
}

bool repair(RGB* c) {
  if (is_usable(*c)) return false;
  *c = c->is_finite() ? RGB(std::max(c->r, 0.0f), std::max(c->g, 0.0f), std::max(c->b, 0.0f)) : RGB();
  return true;
}

bool is_orthonormal(const Frame& f) {
  const auto near = [](float value, float wanted) { return std::abs(value - wanted) < 1e-2f; };
  return near(length2(f.n), 1) && near(length2(f.s), 1) && near(length2(f.t), 1) && near(dot(f.n, f.s), 0) &&
         near(dot(f.n, f.t), 0) && near(dot(f.s, f.t), 0);
}

bool scatters_diffusely(const scattering::Bsdf& b) {
  return b.is_diffuse() || b.kind == scattering::BsdfKind::subsurface ||
         (b.kind == scattering::BsdfKind::coated && b.base == scattering::BsdfKind::diffuse);
}

// True if something had to be changed.
bool repair(scattering::Bsdf* b, const pattern::ShadingPoints& points, int i) {
  bool bad = false;
  for (RGB* c : {&b->reflectance, &b->transmittance, &b->eta, &b->k, &b->medium_albedo, &b->extinction})
    bad |= repair(c);
  const auto check = [&bad](float* v, bool right, float otherwise) {
    if (right) return;
    *v = otherwise;
    bad = true;
  };
  for (float* v : {&b->alpha_x, &b->alpha_y, &b->base_alpha_x, &b->base_alpha_y, &b->thickness, &b->coat_return})
    check(v, is_usable(*v), 0);
  check(&b->ior, b->ior > 0 && b->ior < infinity, 1);
  check(&b->g, std::abs(b->g) <= 0.99f, 0);
  const bool known = b->kind <= scattering::BsdfKind::passthrough && b->sample_count > 0 &&
                     (b->kind != scattering::BsdfKind::coated || b->base == scattering::BsdfKind::diffuse ||
                      b->base == scattering::BsdfKind::conductor);
  if (!known) *b = scattering::Bsdf();
  const bool framed = is_orthonormal(b->frame);
  if (!framed || !known) b->frame = Frame(points.Ns[i], points.dPdu[i]);
  return bad || !known || !framed;
}

}  // namespace

GuardedMaterial::GuardedMaterial(std::shared_ptr<const void> code, std::unique_ptr<const Material> shader,
                                 StageSet stages, std::string name)
    : code_(std::move(code)), shader_(std::move(shader)), stages_(stages), name_(std::move(name)) {
  try {
    diffuse_to_rays_ = shader_->is_diffuse_to_rays();
    subsurface_ = shader_->has_subsurface();
    colored_opacity_ = shader_->has_colored_opacity();
    const float work = shader_->work();
    if (work >= 0) work_ = work;
  } catch (...) {  // it says nothing: false is always right
  }
}

// Calls, and keeps what it throws from going further. Only faults of points that are alone count.
template <class Call>
bool GuardedMaterial::attempt(Stage stage, bool alone, const Call& call) const {
  const auto caught = [&](const char* what) {
    if (!alone) return;
    const std::lock_guard lock(mutex_);
    Faults& f = faults_[size_t(stage)];
    if (f.thrown++ == 0 || what < f.message) f.message = what;
  };
  try {
    call();
    return true;
  } catch (const std::exception& e) {
    caught(e.what());
  } catch (...) {
    caught("what is not a std::exception");
  }
  return false;
}

// call(points, i) runs the stage on points that begin at lane i of the batch; reset(i) undoes what it may have written
// there; paint(i) writes the stand-in.
template <class Call, class Reset, class Paint>
void GuardedMaterial::run(Stage stage, const pattern::ShadingPoints& points, const Call& call, const Reset& reset,
                          const Paint& paint) const {
  const bool alone = points.count == 1;
  if (attempt(stage, alone, [&] { call(points, 0); })) return;
  if (alone) {
    reset(0);
    return paint(0);
  }
  pattern::ShadingPoints one;
  one.count = 1;
  for (int i = 0; i < points.count; ++i) {
    one.copy_lane(0, points, i);
    reset(i);
    if (attempt(stage, true, [&] { call(one, i); })) continue;
    reset(i);
    paint(i);
  }
}

void GuardedMaterial::count_bad(Stage stage, int points) const {
  if (points == 0) return;
  const std::lock_guard lock(mutex_);
  faults_[size_t(stage)].bad += uint64_t(points);
}

void GuardedMaterial::repair_colours(Stage stage, int n, RGB* colours) const {
  int bad = 0;
  for (int i = 0; i < n; ++i) bad += repair(&colours[i]);
  count_bad(stage, bad);
}

void GuardedMaterial::displacement(const pattern::ShadingPoints& points, V3f* P) const {
  const auto stay = [&](int i) { P[i] = points.P[i]; };
  for (int i = 0; i < points.count; ++i) stay(i);
  run(
      Stage::displacement, points, [&](const pattern::ShadingPoints& p, int i) { shader_->displacement(p, P + i); },
      [](int) {}, stay);
  int bad = 0;
  for (int i = 0; i < points.count; ++i) {
    if (is_finite(P[i])) continue;
    stay(i);
    ++bad;
  }
  count_bad(Stage::displacement, bad);
}

void GuardedMaterial::opacity(const pattern::ShadingPoints& points, RGB* Oi) const {
  std::fill_n(Oi, points.count, RGB(1));
  run(
      Stage::opacity, points, [&](const pattern::ShadingPoints& p, int i) { shader_->opacity(p, Oi + i); }, [](int) {},
      [&](int i) { Oi[i] = RGB(1); });
  repair_colours(Stage::opacity, points.count, Oi);
}

void GuardedMaterial::prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  std::fill_n(out, points.count, scattering::Bsdf());
  run(
      Stage::prelighting, points, [&](const pattern::ShadingPoints& p, int i) { shader_->prelighting(p, out + i); },
      [](int) {},
      [&](int i) {
        out[i] = scattering::Bsdf::make_diffuse(magenta);
        out[i].frame = Frame(points.Ns[i], points.dPdu[i]);
      });
  int bad = 0;
  for (int i = 0; i < points.count; ++i) {
    bool wrong = repair(&out[i], points, i);
    if (diffuse_to_rays_ && !scatters_diffusely(out[i])) {
      const Frame frame = out[i].frame;
      out[i] = scattering::Bsdf::make_diffuse(clamp(out[i].albedo(), 0, 1));
      out[i].frame = frame;
      wrong = true;
    }
    bad += wrong;
  }
  count_bad(Stage::prelighting, bad);
}

void GuardedMaterial::diffuselighting(const DiffuseLighting& in) const {
  RGB before[capacity];
  std::copy_n(in.diffuse, in.points.count, before);
  run(
      Stage::diffuselighting, in.points,
      [&](const pattern::ShadingPoints& p, int i) {
        shader_->diffuselighting({p, in.bsdf + i, in.irradiance + i, in.irradiance_behind + i, in.diffuse + i});
      },
      [&](int i) { in.diffuse[i] = before[i]; }, [&](int i) { in.diffuse[i] = magenta * in.irradiance[i] * inv_pi; });
  repair_colours(Stage::diffuselighting, in.points.count, in.diffuse);
}

void GuardedMaterial::specularlighting(const SpecularLighting& in) const {
  for (int i = 0; i < in.points.count; ++i) in.Ci[i] = in.diffuse[i] + in.specular[i];
  run(
      Stage::specularlighting, in.points,
      [&](const pattern::ShadingPoints& p, int i) {
        shader_->specularlighting({p, in.bsdf + i, in.wo + i, in.diffuse + i, in.specular + i, in.Ci + i});
      },
      [](int) {}, [&](int i) { in.Ci[i] = magenta * (in.diffuse[i] + in.specular[i]).luminance(); });
  repair_colours(Stage::specularlighting, in.points.count, in.Ci);
}

void GuardedMaterial::postlighting(const PostLighting& in) const {
  RGB before[capacity];
  std::copy_n(in.Ci, in.points.count, before);
  run(
      Stage::postlighting, in.points,
      [&](const pattern::ShadingPoints& p, int i) {
        shader_->postlighting({p, in.bsdf + i, in.wo + i, in.Ci + i});
      },
      [&](int i) { in.Ci[i] = before[i]; }, [&](int i) { in.Ci[i] = magenta * before[i].luminance(); });
  repair_colours(Stage::postlighting, in.points.count, in.Ci);
}

std::array<GuardedMaterial::Faults, stage_count> GuardedMaterial::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

ShaderFaults shader_faults(const std::vector<MaterialPtr>& materials) {
  ShaderFaults all;
  for (const MaterialPtr& material : materials) {
    const auto* guarded = dynamic_cast<const GuardedMaterial*>(material.get());
    if (!guarded) continue;
    const auto faults = guarded->faults();
    for (size_t i = 0; i < faults.size(); ++i) {
      const std::string stage = guarded->name() + ": " + std::string(stage_names[i]);
      const auto at = [](uint64_t n) { return " at " + std::to_string(n) + (n == 1 ? " point" : " points"); };
      const bool lit = Stage(i) >= Stage::prelighting;
      const char* const stand_in = lit ? ", shown in magenta: " : ", which are opaque and not displaced: ";
      if (faults[i].thrown > 0)
        all.errors.push_back(stage + " threw" + at(faults[i].thrown) + stand_in + faults[i].message);
      if (faults[i].bad > 0)
        all.warnings.push_back(stage + " gave values that are wrong" + at(faults[i].bad) + "; they are replaced");
    }
  }
  return all;
}

}  // namespace dapple::shading
