#include "solar/time_point.h"

#include <erfa.h>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace twilight {
namespace {

constexpr int kMaxOffsetMinutes = 23 * 60 + 59;
constexpr int kFirstUtcYear = 1960;                // of ERFA's TAI - UTC table
constexpr double kFirstUtcJulianDate = 2436934.5;  // 1960-01-01
constexpr double kFirstJulianDate = 2415019.5;     // 1899-12-31: a local date may start a day early
constexpr double kLastJulianDate = 2488435.5;      // 2101-01-02, likewise
constexpr double kMicrosecondDays = 1e-6 / 86400.0;

struct DateTimeFields {
  std::chrono::sys_days date;  // of the local calendar
  int hour = 0;
  int minute = 0;
  double second = 0.0;
  int offset_minutes = 0;
};

std::invalid_argument malformed(std::string_view text, const std::string& reason) {
  return std::invalid_argument(
      fmt::format("time \"{}\": {} (expected RFC 3339 with offset, like 2003-12-08T17:00:00+01:00)",
                  text, reason));
}

// Reads the text from left to right; every complaint names the whole text.
class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  int number(std::size_t digits, std::string_view what, int lowest, int highest) {
    int value = 0;
    for (std::size_t i = 0; i < digits; ++i) {
      if (!at_digit()) {
        throw malformed(text_, fmt::format("the {} needs {} digits at position {}", what, digits,
                                           position_ + 1));
      }
      value = 10 * value + (text_[position_++] - '0');
    }
    if (value < lowest || value > highest) {
      throw malformed(text_,
                      fmt::format("the {} {} is outside {}..{}", what, value, lowest, highest));
    }
    return value;
  }

  void expect(char wanted, std::string_view where) {
    if (!accept(wanted)) {
      throw malformed(text_,
                      fmt::format("'{}' missing {} at position {}", wanted, where, position_ + 1));
    }
  }

  bool accept(char wanted) {
    if (position_ >= text_.size() || text_[position_] != wanted) return false;
    ++position_;
    return true;
  }

  double fraction() {
    if (!at_digit()) throw malformed(text_, "no digit follows the decimal point of the second");
    double value = 0.0;
    for (double weight = 0.1; at_digit(); weight *= 0.1) {
      value += weight * (text_[position_++] - '0');
    }
    return value;
  }

  void expect_end() const {
    if (position_ != text_.size()) {
      throw malformed(text_, fmt::format("unexpected text from position {} on", position_ + 1));
    }
  }

 private:
  bool at_digit() const {
    return position_ < text_.size() && text_[position_] >= '0' && text_[position_] <= '9';
  }

  std::string_view text_;
  std::size_t position_ = 0;
};

DateTimeFields read_fields(std::string_view text) {
  Reader reader(text);
  DateTimeFields fields;
  const int year = reader.number(4, "year", kFirstYear, kLastYear);
  reader.expect('-', "after the year");
  const int month = reader.number(2, "month", 1, 12);
  reader.expect('-', "after the month");
  const int day = reader.number(2, "day", 1, 31);
  const std::chrono::year_month_day date{std::chrono::year{year},
                                         std::chrono::month{static_cast<unsigned>(month)},
                                         std::chrono::day{static_cast<unsigned>(day)}};
  if (!date.ok()) throw malformed(text, "that month has no such day");
  fields.date = date;
  if (!reader.accept('T') && !reader.accept('t')) reader.expect('T', "between date and time");
  fields.hour = reader.number(2, "hour", 0, 23);
  reader.expect(':', "after the hour");
  fields.minute = reader.number(2, "minute", 0, 59);
  reader.expect(':', "after the minute");
  fields.second = reader.number(2, "second", 0, 60);
  if (reader.accept('.')) fields.second += reader.fraction();
  if (!reader.accept('Z') && !reader.accept('z')) {
    const bool west = reader.accept('-');
    if (!west && !reader.accept('+')) {
      throw malformed(text, "the offset from UTC (Z, +hh:mm or -hh:mm) is missing");
    }
    const int hours = reader.number(2, "hour of the offset", 0, 23);
    reader.expect(':', "in the offset");
    const int minutes = reader.number(2, "minute of the offset", 0, 59);
    fields.offset_minutes = (west ? -1 : 1) * (60 * hours + minutes);
  }
  reader.expect_end();
  return fields;
}

struct UtcDay {
  int year, month, day;
};

UtcDay calendar(std::chrono::sys_days days) {
  const std::chrono::year_month_day date{days};
  return {static_cast<int>(date.year()), static_cast<int>(static_cast<unsigned>(date.month())),
          static_cast<int>(static_cast<unsigned>(date.day()))};
}

// Before 1960 a scale without ERFA's (there meaningless) steps of TAI - UTC.
const char* scale_of_year(int year) { return year < kFirstUtcYear ? "TT" : "UTC"; }

bool ends_with_leap_second(std::chrono::sys_days day) {
  const UtcDay today = calendar(day);
  const UtcDay tomorrow = calendar(day + std::chrono::days{1});
  if (today.year < kFirstUtcYear) return false;
  double before = 0.0, after = 0.0;
  eraDat(today.year, today.month, today.day, 0.0, &before);
  eraDat(tomorrow.year, tomorrow.month, tomorrow.day, 0.0, &after);
  // The steps before 1972 were fractions of a second and had no second 60.
  return std::abs(after - before - 1.0) < 1e-3;
}

void check_offset(int offset_minutes) {
  if (offset_minutes < -kMaxOffsetMinutes || offset_minutes > kMaxOffsetMinutes) {
    throw std::invalid_argument(fmt::format("offset from UTC of {} minutes is outside {}..{}",
                                            offset_minutes, -kMaxOffsetMinutes, kMaxOffsetMinutes));
  }
}

void check_instant(const UtcTime& time) {
  const double jd = time.jd1 + time.jd2;
  if (!(jd >= kFirstJulianDate && jd <= kLastJulianDate)) {
    throw std::invalid_argument(fmt::format("instant of Julian date {} is outside the years {}..{}",
                                            jd, kFirstYear, kLastYear));
  }
}

// The local calendar's minute that contains the instant (rounded to the given
// decimals of a second), and the second within it.
struct LocalTime {
  std::chrono::sys_days date;
  int hour, minute, second, fraction;
};

LocalTime local_time(const UtcTime& time, int offset_minutes, int fraction_digits) {
  check_offset(offset_minutes);
  check_instant(time);
  int year = 0, month = 0, day = 0;
  std::array<int, 4> clock{};
  const char* scale = time.jd1 + time.jd2 < kFirstUtcJulianDate ? "TT" : "UTC";
  if (eraD2dtf(scale, fraction_digits, time.jd1, time.jd2, &year, &month, &day, clock.data()) < 0) {
    throw std::invalid_argument(
        fmt::format("instant of Julian date {} has no calendar date", time.jd1 + time.jd2));
  }
  // Zones differ from UTC by whole minutes: the second, 60 included, carries over.
  std::chrono::sys_days date{std::chrono::year_month_day{
      std::chrono::year{year}, std::chrono::month{static_cast<unsigned>(month)},
      std::chrono::day{static_cast<unsigned>(day)}}};
  int minutes = 60 * clock[0] + clock[1] + offset_minutes;
  constexpr int kDayMinutes = 24 * 60;
  if (minutes < 0) {
    minutes += kDayMinutes;
    date -= std::chrono::days{1};
  } else if (minutes >= kDayMinutes) {
    minutes -= kDayMinutes;
    date += std::chrono::days{1};
  }
  return {date, minutes / 60, minutes % 60, clock[2], clock[3]};
}

UtcTime instant(const DateTimeFields& local, std::string_view text) {
  std::chrono::sys_days date = local.date;
  int minutes = 60 * local.hour + local.minute - local.offset_minutes;
  constexpr int kDayMinutes = 24 * 60;
  if (minutes < 0) {
    minutes += kDayMinutes;
    date -= std::chrono::days{1};
  } else if (minutes >= kDayMinutes) {
    minutes -= kDayMinutes;
    date += std::chrono::days{1};
  }
  if (local.second >= 60.0 && !(minutes == kDayMinutes - 1 && ends_with_leap_second(date))) {
    throw malformed(text, "second 60, but UTC has no leap second there");
  }
  const UtcDay day = calendar(date);
  UtcTime time;
  if (eraDtf2d(scale_of_year(day.year), day.year, day.month, day.day, minutes / 60, minutes % 60,
               local.second, &time.jd1, &time.jd2) < 0) {
    throw malformed(text, "no such instant");
  }
  return time;
}

}  // namespace

UtcTime parse_offset_date_time(std::string_view text) { return instant(read_fields(text), text); }

int parse_utc_offset_minutes(std::string_view text) {
  const DateTimeFields fields = read_fields(text);
  instant(fields, text);  // for its complaint about second 60
  return fields.offset_minutes;
}

std::string format_offset_date_time(const UtcTime& time, int offset_minutes, int fraction_digits) {
  if (fraction_digits < 0 || fraction_digits > 9) {
    throw std::invalid_argument(
        fmt::format("{} decimals of the second is outside 0..9", fraction_digits));
  }
  const LocalTime local = local_time(time, offset_minutes, fraction_digits);
  const UtcDay day = calendar(local.date);
  std::string text = fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}", day.year, day.month,
                                 day.day, local.hour, local.minute, local.second);
  if (fraction_digits > 0) text += fmt::format(".{:0{}}", local.fraction, fraction_digits);
  if (offset_minutes == 0) return text + "Z";
  const int size = std::abs(offset_minutes);
  return text + fmt::format("{}{:02}:{:02}", offset_minutes < 0 ? '-' : '+', size / 60, size % 60);
}

UtcTime local_midnight(const UtcTime& time, int offset_minutes, int plus_days) {
  DateTimeFields midnight;
  midnight.date = local_time(add_days(time, kMicrosecondDays), offset_minutes, 9).date +
                  std::chrono::days{plus_days};
  midnight.offset_minutes = offset_minutes;
  const UtcTime start = instant(midnight, "local midnight");
  check_instant(start);
  return start;
}

UtcTime add_days(const UtcTime& time, double days) { return {time.jd1, time.jd2 + days}; }

double days_between(const UtcTime& earlier, const UtcTime& later) {
  return (later.jd1 - earlier.jd1) + (later.jd2 - earlier.jd2);
}

EphemerisTime ephemeris_time(const UtcTime& time) {
  check_instant(time);
  EphemerisTime result;
  if (time.jd1 + time.jd2 < kFirstUtcJulianDate) {
    result.ut11 = time.jd1;
    result.ut12 = time.jd2;
    const double year = 2000.0 + ((time.jd1 - 2451544.5) + time.jd2) / 365.25;
    eraUt1tt(time.jd1, time.jd2, delta_t_s(year), &result.tt1, &result.tt2);
    return result;
  }
  double tai1 = 0.0, tai2 = 0.0;
  if (eraUtctai(time.jd1, time.jd2, &tai1, &tai2) < 0 ||
      eraTaitt(tai1, tai2, &result.tt1, &result.tt2) < 0 ||
      eraUtcut1(time.jd1, time.jd2, 0.0, &result.ut11, &result.ut12) < 0) {
    throw std::invalid_argument(
        fmt::format("instant of Julian date {} has no terrestrial time", time.jd1 + time.jd2));
  }
  return result;
}

double delta_t_s(double decimal_year) {
  if (!(decimal_year >= 1899.0 && decimal_year <= 1962.0)) {
    throw std::invalid_argument(
        fmt::format("year {} of Delta T is outside 1899..1962", decimal_year));
  }
  if (decimal_year < 1920.0) {
    const double t = decimal_year - 1900.0;
    return -2.79 + t * (1.494119 + t * (-0.0598939 + t * (0.0061966 - t * 0.000197)));
  }
  if (decimal_year < 1941.0) {
    const double t = decimal_year - 1920.0;
    return 21.20 + t * (0.84493 + t * (-0.076100 + t * 0.0020936));
  }
  const double t = decimal_year - 1950.0;
  return 29.07 + t * (0.407 + t * (-1.0 / 233.0 + t / 2547.0));
}

}  // namespace twilight
