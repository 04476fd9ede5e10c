// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/scene_description.h"

#include "dapple/base/hash.h"
#include "dapple/scenefile/far_points.h"

namespace dapple::scenefile {

std::string SceneDescription::resolve(const std::string& filename) const {
  if (filename.empty() || filename.front() == '/' || base_directory.empty()) return filename;
  return base_directory.back() == '/' ? base_directory + filename : base_directory + "/" + filename;
}

namespace {

template <class Number>
std::array<Number, 12> rows_of(const Transform& t) {
  std::array<Number, 12> rows;
  for (int i = 0; i < 12; ++i) rows[size_t(i)] = Number(t.matrix()[i / 4][i % 4]);
  return rows;
}

template <class Number>
Transform transform_of(const std::array<Number, 12>& rows) {
  M44d m;
  for (int i = 0; i < 12; ++i) m[i / 4][i % 4] = double(rows[size_t(i)]);
  return Transform(m);
}

}  // namespace

CompactTransform::CompactTransform(const TransformPair& affine) : start_(rows_of<float>(affine.start)) {
  const bool moves = affine.is_animated();
  if (moves) end_ = std::make_unique<const Rows>(rows_of<float>(affine.end));
  const auto is_far = [](const Transform& t) {
    const M44d& m = t.matrix();
    return std::max({std::abs(m[0][3]), std::abs(m[1][3]), std::abs(m[2][3])}) >= nearest_far;
  };
  if (!is_far(affine.start) && !is_far(affine.end)) return;
  auto exact = std::make_unique<ExactRows[]>(moves ? 2 : 1);
  exact[0] = rows_of<double>(affine.start);
  if (moves) exact[1] = rows_of<double>(affine.end);
  far_ = std::move(exact);
}

TransformPair CompactTransform::expand() const {
  const Transform start = transform_of(start_);
  return {start, end_ ? transform_of(*end_) : start};
}

TransformPair CompactTransform::exact() const {
  if (!far_) return expand();
  const Transform start = transform_of(far_[0]);
  return {start, end_ ? transform_of(far_[1]) : start};
}

bool operator==(const CompactTransform& a, const CompactTransform& b) {
  const bool both_move = a.end_ && b.end_;
  if (bool(a.end_) != bool(b.end_)) return false;
  if (a.far_ && b.far_ && (a.far_[0] != b.far_[0] || (both_move && a.far_[1] != b.far_[1]))) return false;
  return a.start_ == b.start_ && (!both_move || *a.end_ == *b.end_);
}

uint64_t CompactTransform::key() const {
  const auto bytes = [](const Rows& rows) {
    return std::string_view(reinterpret_cast<const char*>(rows.data()), sizeof(Rows));
  };
  const uint64_t start = hash_bytes(bytes(start_), 0);
  return end_ ? hash_bytes(bytes(*end_), start) : start;
}

}  // namespace dapple::scenefile
