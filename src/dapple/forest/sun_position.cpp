// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sun_position.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dapple::forest {

namespace {

constexpr double degree = std::numbers::pi / 180;

/// Days from 2000-01-01 12:00 to 0:00 of a day of the Gregorian calendar (Fliegel and van Flandern 1968).
double days_since_2000(int year, int month, int day) {
  const int a = (14 - month) / 12, y = year + 4800 - a, m = month + 12 * a - 3;
  const int julian = day + (153 * m + 2) / 5 + 365 * y + y / 4 - y / 100 + y / 400 - 32045;
  return julian - 2451545 - 0.5;
}

}  // namespace

int days_of_month(int year, int month) {
  if (month < 1 || month > 12) return 0;
  constexpr int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  const bool leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
  return days[month - 1] + (month == 2 && leap ? 1 : 0);
}

SunPosition sun_position(const PlaceAndTime& at) {
  const double n = days_since_2000(at.year, at.month, at.day) + at.hour / 24;
  const double mean_longitude = 280.460 + 0.9856474 * n, anomaly = (357.528 + 0.9856003 * n) * degree;
  const double longitude = (mean_longitude + 1.915 * std::sin(anomaly) + 0.020 * std::sin(2 * anomaly)) * degree;
  const double obliquity = (23.439 - 0.0000004 * n) * degree;
  const double right_ascension = std::atan2(std::cos(obliquity) * std::sin(longitude), std::cos(longitude));
  const double declination = std::asin(std::sin(obliquity) * std::sin(longitude));
  const double sidereal_hours = 6.697375 + 0.0657098242 * n + at.hour;
  const double hour_angle = (sidereal_hours * 15 + at.longitude_deg) * degree - right_ascension;

  const double latitude = at.latitude_deg * degree;
  const double up =
      std::sin(declination) * std::sin(latitude) + std::cos(declination) * std::cos(latitude) * std::cos(hour_angle);
  const double east = -std::cos(declination) * std::sin(hour_angle);
  const double north =
      std::sin(declination) * std::cos(latitude) - std::cos(declination) * std::sin(latitude) * std::cos(hour_angle);
  const double compass = std::atan2(east, north) / degree;
  return {std::acos(std::clamp(up, -1.0, 1.0)) / degree, compass < 0 ? compass + 360 : compass};
}

std::vector<SunOfHour> sun_course(PlaceAndTime at, double from_hour, double to_hour, int count) {
  std::vector<SunOfHour> course;
  for (int i = 0; i < count; ++i) {
    at.hour = count == 1 ? from_hour : from_hour + (to_hour - from_hour) * i / (count - 1);
    course.push_back({at.hour, sun_position(at)});
  }
  return course;
}

bool is_known_day(int year, int month, int day) {
  return year >= 1950 && year <= 2050 && day >= 1 && day <= days_of_month(year, month);
}

}  // namespace dapple::forest
