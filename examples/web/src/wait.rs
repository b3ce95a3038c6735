//! For the device, without holding up the page.

use js_sys::{Function, Promise};
use subsurface_lab::renderer::Readback;
use wasm_bindgen::{JsError, JsValue};
use wasm_bindgen_futures::JsFuture;
use wgpu::{MapMode, Queue};

/// Bytes that were copied out.
pub async fn bytes(readback: Readback) -> Result<Vec<u8>, JsError> {
    until(|resolve, reject| {
        readback.buffer.map_async(MapMode::Read, .., move |mapped| {
            let _ = match mapped {
                Ok(()) => resolve.call0(&JsValue::NULL),
                Err(error) => reject.call1(&JsValue::NULL, &error.to_string().into()),
            };
        });
    })
    .await?;
    Ok(readback.bytes())
}

/// Until all that was submitted is done.
pub async fn done(queue: &Queue) -> Result<(), JsError> {
    until(|resolve, _| {
        queue.on_submitted_work_done(move || {
            let _ = resolve.call0(&JsValue::NULL);
        });
    })
    .await
}

/// Until one of two functions is called, which ends in success or not.
async fn until(start: impl FnOnce(Function, Function)) -> Result<(), JsError> {
    let mut start = Some(start);
    let promise = Promise::new(&mut |resolve, reject| {
        if let Some(start) = start.take() {
            start(resolve, reject);
        }
    });
    let ended = JsFuture::from(promise).await;
    ended.map(|_| ()).map_err(|error| JsError::new(&error.as_string().unwrap_or_default()))
}
