/* The logger of FMI 2.0 is variadic, which only C can implement. Its arguments are formatted as a text here. */
#include <stdarg.h>
#include <stdio.h>

typedef void (*stickslip_take)(const void *log, int status, const char *text);

/* The first field of a log is the function that takes its texts. */
void stickslip_fmu_log(void *log, const char *instance, int status, const char *category, const char *format, ...) {
    char text[2048];
    va_list arguments;
    (void)instance;
    (void)category;
    if ((log == NULL) || (format == NULL)) {
        return;
    }
    va_start(arguments, format);
    if (vsnprintf(text, sizeof text, format, arguments) >= 0) {
        (*(const stickslip_take *)log)(log, status, text);
    }
    va_end(arguments);
}
